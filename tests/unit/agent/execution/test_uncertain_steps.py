"""Barred steps: one that may have succeeded starts again only where its success is measurably excluded."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import pytest

from aeros.agent.execution.uncertain_steps import UncertainSteps, possible_success
from aeros.agent.world.world import WorldModel, world_from_readings
from aeros.runtime.ports import Reading
from tests.unit.agent.dumplings import STATE, outcome, skill

WRAP = skill(
    "wrap",
    outcome("wrapped", {"dumpling_wrapped": True, "wrapper_aligned": True}),
    outcome("folded", {"area": "pot"}),
    outcome("torn", {}, failure=True),
)
SUCCESS_EXCLUDED = {"dumpling_wrapped": False, "area": "table"}


def world(**values: Any) -> WorldModel:
    return world_from_readings(STATE, {name: Reading(value, 0.0) for name, value in values.items()}, 0.0)


@pytest.mark.parametrize(
    ("measured", "possible"),
    [
        ({}, "wrapped"),  # unknown values exclude nothing
        ({"dumpling_wrapped": True}, "wrapped"),
        ({"dumpling_wrapped": True, "wrapper_aligned": False}, "folded"),
        ({"dumpling_wrapped": False}, "folded"),
        (SUCCESS_EXCLUDED, None),
        ({"dumpling_wrapped": False, "area": "pot"}, "folded"),
    ],
)
def test_one_measured_value_excludes_a_success(measured: dict[str, Any], possible: str | None) -> None:
    assert possible_success(WRAP, world(**measured)) == possible


def test_a_skill_with_failures_alone_cannot_have_succeeded() -> None:
    assert possible_success(skill("tear", outcome("torn", {}, failure=True)), world()) is None


def test_nothing_is_barred_at_first() -> None:
    bars = UncertainSteps()
    assert bars.to_checkpoint == ()
    assert bars.reason_not_to_start("m", WRAP, {}, world()) is None


def test_a_barred_step_is_named_with_the_success_that_is_possible() -> None:
    bars = UncertainSteps()
    bars.add("m", "wrap", {})
    reason = bars.reason_not_to_start("m", WRAP, {}, world())
    assert reason == ("it began before a crash, and the measurements do not exclude that `wrapped` happened")
    assert bars.reason_not_to_start("m", WRAP, {}, world(**SUCCESS_EXCLUDED)) is None


@pytest.mark.parametrize(("module", "inputs"), [("other", {"force": 0.5}), ("m", {}), ("m", {"force": 0.25})])
def test_only_the_very_step_is_barred(module: str, inputs: dict[str, Any]) -> None:
    bars = UncertainSteps()
    bars.add("m", "wrap", {"force": 0.5})
    assert bars.reason_not_to_start(module, WRAP, inputs, world()) is None
    assert bars.reason_not_to_start("m", skill("boil", *WRAP.outcomes.values()), {}, world()) is None


def test_inputs_are_the_same_in_any_order_and_exact_or_not() -> None:
    bars = UncertainSteps()
    bars.add("m", "wrap", {"a": 0.5, "b": [1.0, 2.0]})
    exact = {"b": (Fraction(1), Fraction(2)), "a": Fraction(1, 2)}
    assert bars.reason_not_to_start("m", WRAP, exact, world()) is not None


def test_a_later_session_bars_the_same_steps() -> None:
    bars, later = UncertainSteps(), UncertainSteps()
    bars.add("n", "wrap", {})
    bars.add("m", "wrap", {"force": 0.5})
    bars.add("m", "wrap", {"force": 0.5})
    assert bars.to_checkpoint == ('["m", "wrap", {"force": 0.5}]', '["n", "wrap", {}]')
    later.restore(bars.to_checkpoint)
    assert later.to_checkpoint == bars.to_checkpoint
    assert later.reason_not_to_start("n", WRAP, {}, world()) is not None
