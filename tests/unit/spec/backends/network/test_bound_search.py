from __future__ import annotations

import math
from dataclasses import replace

import pytest

from aeros.spec.backends.network.bound_search import (
    BoundSearch,
    _corners,
    _halves,
    _importance,
    _inside,
    _middle,
    decide_bound,
    nearest,
    violates,
)
from aeros.spec.backends.network.steps import Linear, Network
from tests.unit.spec.backends.network.networks import TENT, network_of, random_layers, rounded

BOX = {"x": ([0.0], [2.0])}


def test_a_bound_that_one_box_leaves_open_is_proved_in_parts() -> None:
    result = decide_bound(network_of(TENT), BOX, {"y": ((-0.1, 1.1),)})
    assert result == BoundSearch(True, None, result.parts)
    assert result.parts > 1


def test_a_bound_that_is_violated_has_a_witness_inside_of_the_box() -> None:
    network = network_of(TENT)
    result = decide_bound(network, BOX, {"y": ((-0.1, 0.9),)})
    assert result == BoundSearch(False, result.witness, 1)
    assert result.witness is not None
    assert violates(network, result.witness, {"y": ((-0.1, 0.9),)})
    assert 0.9 < result.witness["x"][0] < 1.1


@pytest.mark.parametrize(("is_double", "middle"), [(True, 1.025), (False, rounded(1.025))])
def test_the_middle_that_violates_is_a_number_of_the_networks_format(is_double: bool, middle: float) -> None:
    network = replace(network_of(TENT), is_double=is_double)
    found = decide_bound(network, {"x": ([0.125], [1.925])}, {"y": ((-1.0, 0.96),)})
    assert found == BoundSearch(False, {"x": (middle,)}, 1)


def test_a_violation_at_a_corner_is_found_first() -> None:
    result = decide_bound(network_of(TENT), BOX, {"y": ((0.5, 2.0),)})
    assert result.witness in ({"x": (0.0,)}, {"x": (2.0,)})
    assert result == BoundSearch(False, result.witness, 0)


def test_a_bound_without_room_for_rounding_is_left_open() -> None:
    result = decide_bound(network_of(TENT), BOX, {"y": ((-0.1, 1.0),)}, max_parts=50)
    assert result == BoundSearch(False, None, 50)


def test_a_box_that_cannot_be_split_is_left_open() -> None:
    """Its only side is a number, whose output is on the bound and not surely on one side of it."""
    point = {"x": ([1.0], [1.0])}
    assert decide_bound(network_of(TENT), point, {"y": ((-0.1, 1.0),)}) == BoundSearch(False, None, 1)


def test_an_output_that_is_clipped_is_proved_at_once() -> None:
    network = network_of(random_layers(1))
    assert decide_bound(network, {"x": ([-9.0] * 3, [9.0] * 3)}, {"y": ((-1.0, 1.0),) * 2}).parts == 1


@pytest.mark.parametrize(("number", "single"), [(0.5, 0.5), (0.1, 0.10000000149011612)])
def test_numbers_are_rounded_to_the_format(number: float, single: float) -> None:
    assert nearest(number, is_double=False) == single
    assert nearest(number, is_double=True) == number


def test_bounds_of_another_length_are_refused_and_not_cut_off() -> None:
    network = network_of(TENT)
    for ends in (((-9.0, 9.0),) * 2, ()):
        with pytest.raises(ValueError, match="argument 3 is"):
            violates(network, {"x": (1.0,)}, {"y": ends})
        with pytest.raises(ValueError, match="argument 3 is"):
            _inside({"y": ([0.0], [1.0])}, {"y": ends})
    for box in ({"x": ([0.0], [1.0, 2.0])}, {"x": ([0.0, 0.0], [1.0])}):
        for read in (lambda box: _middle(box, is_double=True), lambda box: list(_corners(box))):
            with pytest.raises(ValueError, match="argument 2 is"):
                read(box)
        with pytest.raises(ValueError, match="argument 2 is"):
            _halves(box, {"x": (1.0, 1.0)})
    uneven = Network(
        {"x": 2}, {"y": "y"}, (Linear("y", "x", ((1.0, 2.0), (1.0,)), (0.0, 0.0)),), is_double=True
    )
    with pytest.raises(ValueError, match="argument 2 is shorter"):
        _importance(uneven)


def test_the_corners_of_a_box_are_all_of_the_first_sides() -> None:
    box = {"x": ([0.0, 1.0], [2.0, 3.0]), "z": ([4.0], [5.0])}
    found = [(one["x"], one["z"]) for one in _corners(box)]
    assert found == [((x, y), (z,)) for x in (0.0, 2.0) for y in (1.0, 3.0) for z in (4.0, 5.0)]
    wide = {"x": ([0.0] * 40, [1.0] * 40)}
    many = [one["x"] for one in _corners(wide)]
    free = int(math.log2(len(many)))
    assert len(set(many)) == len(many) == 2**free
    assert {one[free:] for one in many} == {(0.0,) * (40 - free)}


def test_a_box_is_halved_at_its_most_important_side() -> None:
    box = {"x": ([0.0, 0.0], [4.0, 3.0]), "z": ([0.0], [5.0])}
    assert _halves(box, {"x": (1.0, 2.0), "z": (1.0,)}) == (
        {"x": ([0.0, 0.0], [4.0, 1.5]), "z": ([0.0], [5.0])},
        {"x": ([0.0, 1.5], [4.0, 3.0]), "z": ([0.0], [5.0])},
    )
    assert _halves({"x": ([1.0], [1.0])}, {"x": (1.0,)}) is None
    for low in (1.0, 1.0 + 2.0**-52):  # the middle is rounded down, and up
        assert _halves({"x": ([low], [low + 2.0**-52])}, {"x": (1.0,)}) is None
    assert _middle(box, is_double=True) == {"x": (2.0, 1.5), "z": (2.5,)}
    third = {"x": ([0.1], [0.1])}
    assert _middle(third, is_double=False) == {"x": (0.1,)}
    assert _middle({"x": ([1.0, -4.0], [2.0, -1.0])}, is_double=True) == {"x": (1.5, -2.5)}
    assert _middle({"x": ([0.1], [0.3])}, is_double=True) == {"x": (0.2,)}
    far = {"x": ([10.0, 0.0], [11.0, 3.0])}
    assert _halves(far, {"x": (1.0, 1.0)}) == (
        {"x": ([10.0, 0.0], [11.0, 1.5])},
        {"x": ([10.0, 1.5], [11.0, 3.0])},
    )


def test_a_side_is_as_important_as_what_the_first_layer_makes_of_it() -> None:
    steps = (
        Linear("a", "x", ((1.0, -2.0), (0.5, 0.0)), (0.0, 0.0)),
        Linear("b", "x", ((1.0, 1.0),), (0.0,)),
        Linear("y", "a", ((9.0, 9.0),), (0.0,)),
    )
    network = Network({"x": 2, "z": 1}, {"y": "y"}, steps, is_double=True)
    assert _importance(network) == {"x": (2.5, 3.0), "z": (1.0,)}
