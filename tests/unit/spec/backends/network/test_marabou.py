"""Marabou, where it is installed: `pip install '.[learned-proof]'`; no lock file holds it."""

from __future__ import annotations

import pytest

from aeros.spec.backends.network.bound_search import violates
from aeros.spec.backends.network.marabou import decide_with_marabou, marabou_version
from tests.unit.spec.backends.network.networks import TENT, network_of, random_layers

BOX = {"x": ([0.0], [2.0])}


def test_a_network_that_is_not_piecewise_linear_is_left_open() -> None:
    network = network_of(random_layers(0, activation="Tanh"))
    result = decide_with_marabou(network, {"x": ([0.0] * 3, [1.0] * 3)}, {"y": ((-2.0, 2.0),) * 2})
    assert (result.is_proved, result.witness) == (False, None)


@pytest.mark.skipif(marabou_version() is not None, reason="Marabou is installed")
def test_a_process_that_ends_without_an_answer_leaves_the_bound_open() -> None:
    result = decide_with_marabou(network_of(TENT), BOX, {"y": ((-0.1, 1.1),)})
    assert (result.is_proved, result.witness) == (False, None)


def test_marabou_agrees_with_boxes_and_a_violation_has_a_witness() -> None:
    pytest.importorskip("maraboupy")
    network = network_of(TENT)
    assert decide_with_marabou(network, BOX, {"y": ((-0.1, 1.1),)}).is_proved
    refuted = decide_with_marabou(network, BOX, {"y": ((-0.1, 0.9),)})
    assert refuted.witness is not None
    assert violates(network, refuted.witness, {"y": ((-0.1, 0.9),)})
