from __future__ import annotations

import pytest

from aeros.spec.backends.network.bound_search import decide_bound, nearest, violates
from tests.unit.spec.backends.network.networks import TENT, network_of, random_layers

BOX = {"x": ([0.0], [2.0])}


def test_a_bound_that_one_box_leaves_open_is_proved_in_parts() -> None:
    result = decide_bound(network_of(TENT), BOX, {"y": ((-0.1, 1.1),)})
    assert result.is_proved
    assert result.parts > 1


def test_a_bound_that_is_violated_has_a_witness_inside_of_the_box() -> None:
    network = network_of(TENT)
    result = decide_bound(network, BOX, {"y": ((-0.1, 0.9),)})
    assert not result.is_proved
    assert result.witness is not None
    assert violates(network, result.witness, {"y": ((-0.1, 0.9),)})
    assert 0.9 < result.witness["x"][0] < 1.1


def test_a_violation_at_a_corner_is_found_first() -> None:
    result = decide_bound(network_of(TENT), BOX, {"y": ((0.5, 2.0),)})
    assert result.witness in ({"x": (0.0,)}, {"x": (2.0,)})
    assert result.parts == 0


def test_a_bound_without_room_for_rounding_is_left_open() -> None:
    result = decide_bound(network_of(TENT), BOX, {"y": ((-0.1, 1.0),)}, max_parts=50)
    assert not result.is_proved
    assert result.witness is None


def test_an_output_that_is_clipped_is_proved_at_once() -> None:
    network = network_of(random_layers(1))
    assert decide_bound(network, {"x": ([-9.0] * 3, [9.0] * 3)}, {"y": ((-1.0, 1.0),) * 2}).parts == 1


@pytest.mark.parametrize(("number", "single"), [(0.5, 0.5), (0.1, 0.10000000149011612)])
def test_numbers_are_rounded_to_the_format(number: float, single: float) -> None:
    assert nearest(number, is_double=False) == single
    assert nearest(number, is_double=True) == number
