"""Agents over sessions: what memory brings is what is exact, and the agent's own memory brings it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pytest

from aeros.experiments.catalogue import catalogue
from aeros.experiments.condition import TrialCondition
from aeros.experiments.trial_kinds import Findings
from aeros.experiments.trials.sessions import KIND, _rate
from tests.unit.experiments.support.common import ROOT, premises


def settings(plant: str, row: str, changed: Mapping[str, Any]) -> TrialCondition:
    rows = {one.id: one for one in catalogue(plant)[11].rows}
    return TrialCondition.create("sessions", plant, {**rows[f"11/{row}"].condition.settings, **changed})


def trials(count: int, row: str, plant: str = "symbolic", **changed: Any) -> list[Findings]:
    with KIND.open(settings(plant, row, changed), premises()) as trial:
        return [trial(seed) for seed in range(count)]


NEVER = {"skill": "direct", "outcome": "missed", "rates": [[0, 1.0]], "seconds": 6.0}
ALWAYS = {"skill": "around", "outcome": "missed", "rates": [[0, 0.0]], "seconds": 8.0}


@pytest.mark.parametrize("row", ["once/on", "once/off"])
def test_measured_values_agree_with_exact_values(row: str) -> None:
    changed: dict[str, Any] = {"sessions": 12, "first": NEVER, "second": ALWAYS}
    found = trials(20, row, **changed)
    exact = KIND.expected_values(settings("symbolic", row, changed), premises())
    assert not isinstance(exact, str)
    mean = sum(one["successes"] for one in found) / 20
    assert mean == pytest.approx(exact["successes"], rel=0.1)
    # Each failure is one of a skill that never succeeds, beside one that always does.
    assert all(one["regret"] == 12 - one["successes"] for one in found)
    assert all(one["tries"] == 1 for one in found)


def test_memory_outlives_its_sessions_and_is_looked_at() -> None:
    changed: dict[str, Any] = {"sessions": 20, "first": NEVER, "second": ALWAYS}
    on, off = (trials(6, f"once/{memory}", **changed) for memory in ("on", "off"))
    assert sum(one["late"] for one in on) > sum(one["late"] for one in off) + 10


def test_planned_again_a_session_succeeds_after_more_tries() -> None:
    changed: dict[str, Any] = {"sessions": 6, "first": NEVER, "second": ALWAYS}
    found = trials(4, "again/off", **changed)
    assert all(one["reached"] for one in found)
    assert any(one["tries"] > 1 for one in found)
    assert KIND.expected_values(settings("symbolic", "again/off", changed), premises()) == (
        "its sessions have several tries each, and how many follows from chance"
    )


def test_the_same_seed_finds_the_same() -> None:
    changed: dict[str, Any] = {"sessions": 5}
    first, second = (trials(2, "again/on", **changed) for _ in range(2))
    assert [{**one, "processor_s": 0} for one in first] == [{**one, "processor_s": 0} for one in second]


@pytest.mark.parametrize(("number", "rate"), [(0, 0.1), (10, 0.1), (15, 0.5), (20, 0.9), (49, 0.9)])
def test_a_rate_changes_evenly_between_points(number: int, rate: float) -> None:
    assert _rate([(10, 0.1), (20, 0.9)], number) == pytest.approx(rate)


def test_the_traced_results_add_up_to_the_exact_ones() -> None:
    condition = settings("symbolic", "once/on", {})
    exact, traced = KIND.expected_values(condition, premises()), KIND.expected_series(condition)
    assert not isinstance(exact, str)
    assert sum(traced["success"]) == pytest.approx(exact["successes"])
    assert sum(traced["best"]) - sum(traced["success"]) == pytest.approx(exact["regret"])
    assert len(traced["success"]) == 50


def test_the_numbers_of_the_page_about_memory_are_those_that_are_predicted() -> None:
    on, off = (settings("symbolic", f"once/{memory}", {}) for memory in ("on", "off"))
    with_memory, without = (KIND.expected_series(one)["success"] for one in (on, off))
    page = (ROOT / "docs" / "experiments.md").read_text(encoding="utf-8").replace("\n", " ")
    change = slice(15, 29)
    worse = [
        n for n, (one, other) in enumerate(zip(with_memory, without, strict=True), 1) if one < other - 0.01
    ]
    assert sum(with_memory[change]) > sum(without[change])
    assert f"From the {worse[0]}th to the {worse[-1]}nd session" in page
    assert f"ahead, with {sum(with_memory[change]):.1f} successes against {sum(without[change]):.1f}" in page
    assert f"{100 * with_memory[-1]:.0f} against {100 * without[-1]:.0f} % in the last one" in page
    assert (
        f"50 sessions it is ahead, with {sum(with_memory):.1f} successes against {sum(without):.1f}" in page
    )


@pytest.mark.deep
@pytest.mark.physics
def test_on_physics_a_skill_fails_as_often_as_its_survey_does_not_answer() -> None:
    first = {**NEVER, "rates": [[1, 1.0]]}
    (found,) = trials(1, "once/off", "physics", sessions=6, first=first, second=ALWAYS)
    # Where a skill that always fails was taken, and nowhere else.
    assert found["regret"] == 6 - found["successes"]
    assert 0 < found["successes"] < 6
