"""A streak of declared failures is given up only where chance does not explain it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from math import prod
from pathlib import Path
from uuid import uuid4

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.agent.agent import start_agent
from aeros.agent.execution.failure_streak import (
    LEAST_CHANCE,
    FailureStreak,
    Quantities,
    quantities_of,
)
from aeros.agent.execution.report import RunReport
from aeros.agent.identity import Identity
from aeros.agent.memory.context import evidence_context
from aeros.agent.memory.experience import PRIOR_TRIES
from aeros.agent.memory.posterior import SuccessRecord
from aeros.agent.memory.store import EpisodeEnd, EpisodeStart, open_memory
from aeros.agent.world.world import world_from_readings
from aeros.runtime.ports import Reading
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import VectorType
from aeros.spec.expr.units import LENGTH
from aeros.spec.model.ecm import Skill
from aeros.spec.model.variables import Declared
from tests.unit.agent.dumplings import PREDICATES, SPAN, STATE, module, outcome, rule, site, skill, task
from tests.unit.agent.fake_runtime import FakeRuntime

STATE_BEFORE = {"there": False}
LOOK_ID = ("m", "look")


def look(name: str = "look", failure: Fraction = Fraction(1, 20)) -> Skill:
    seen = replace(outcome("seen", {"dumpling_cooked": True}), probability=1 - failure)
    return skill(name, seen, replace(outcome("not_seen", {}, failure=True), probability=failure))


def reason(streak: FailureStreak, now: float) -> str:
    """Reason to give `look` up."""
    return streak.reason_to_stop(("m", "look"), STATE_BEFORE, now)


def streak_of(
    times: int, record: SuccessRecord, *others: str, quantities: Sequence[Quantities] = ({},)
) -> FailureStreak:
    """As many failures of `look`, which had this record before, and of each of the others, which had none.

    After each, one of the quantities is measured, in turn.
    """
    streak = FailureStreak()
    for number in range(times):
        now = SuccessRecord(record.successes, record.failures + number + 1)
        measured = quantities[number % len(quantities)]
        streak.add(("m", "look"), look(), STATE_BEFORE, 5.0 * number, now, measured)
        for other in others:
            now = SuccessRecord(0, number + 1)
            streak.add(("m", other), look(other), STATE_BEFORE, 5.0 * number, now, measured)
    return streak


@given(st.integers(1, 9), st.integers(0, 50), st.integers(0, 50))
def test_the_probability_is_that_of_record_and_declaration(times: int, successes: int, failures: int) -> None:
    streak = streak_of(times, SuccessRecord(successes, failures))
    tries = successes + failures + PRIOR_TRIES
    exact = prod((failures + PRIOR_TRIES / 20 + i) / (tries + i) for i in range(times))
    for still in (True, False):
        assert streak.probability_by_chance(LOOK_ID, STATE_BEFORE, still=still) == pytest.approx(exact)


def test_a_skill_without_a_record_is_given_up_at_the_sixth_failure() -> None:
    new = SuccessRecord(0, 0)
    assert reason(streak_of(5, new), 1e4) == ""
    assert reason(streak_of(6, new), 14.9) == ""  # too soon
    assert reason(streak_of(6, new), 30.0) == "it failed 6 times in the same measured state in 30 s"


@given(st.fractions(Fraction(1, 50), Fraction(1, 2)))
def test_chance_as_declared_is_given_up_less_than_once_in_a_thousand_times(failure: Fraction) -> None:
    streak, times = FailureStreak(), 0
    while reason(streak, 1e4) == "":
        times += 1
        now = SuccessRecord(0, times)
        streak.add(("m", "look"), look(failure=failure), STATE_BEFORE, 0.0, now, {})
    assert float(failure) ** times < LEAST_CHANCE


def test_failures_that_change_something_count_by_skill() -> None:
    places: tuple[Quantities, ...] = ({"place": (0.0, 0.0)}, {"place": (0.0, 1.5)})
    moved = streak_of(5, SuccessRecord(0, 0), quantities=places)
    assert reason(moved, 1e4) == ""
    assert "it failed 6 times" in reason(streak_of(6, SuccessRecord(0, 0), quantities=places), 1e4)
    # Within its uncertainty nothing has changed.
    rest: tuple[Quantities, ...] = ({"place": (0.0, 0.0)}, {"place": (0.0, 0.9)})
    found = reason(streak_of(6, SuccessRecord(0, 0), quantities=rest), 30.0)
    assert found == "it failed 6 times in the same measured state in 30 s, and no measured quantity changed"


def test_another_skill_that_helped_a_little_is_no_evidence() -> None:
    places: tuple[Quantities, ...] = ({"place": (0.0,)}, {"place": (2.0,)})
    assert reason(streak_of(3, SuccessRecord(0, 0), "push", quantities=places), 1e4) == ""


def test_quantities_are_in_units_of_their_uncertainty() -> None:
    variable = t.Variable("m.at", VectorType(LENGTH), t.VariableRole.STATE)
    at, bare = Declared(variable, SPAN, uncertainty=Fraction(1, 100)), Declared(variable, SPAN)
    found = quantities_of({"m.at": (1, Fraction(1, 2), 0), "m.bare": (1, 1, 1)}, {"m.at": at, "m.bare": bare})
    assert found == {"m.at": (100.0, 50.0, 0.0)}
    assert quantities_of({}, {"m.at": at}) == {}


def test_a_skill_that_often_failed_has_more_tries() -> None:
    assert reason(streak_of(5, SuccessRecord(6, 6)), 100.0) == ""
    record = SuccessRecord(20, 0)
    assert reason(streak_of(3, record), 20.0) == (
        "it failed 3 times in the same measured state in 20 s, "
        "where it had succeeded in 20 of 20 tries before"
    )


def test_the_failures_of_several_count_together() -> None:
    assert reason(streak_of(3, SuccessRecord(0, 0), "search"), 15.0) == (
        "it failed 3 times in the same measured state in 15 s; `m.search` 3 times did not help"
    )
    often = FailureStreak()
    for name in ("look", "search") * 3:
        often.add(("m", name), look(name, Fraction(9, 10)), STATE_BEFORE, 0.0, SuccessRecord(0, 1), {})
    assert reason(often, 100.0) == ""


def test_a_streak_lasts_through_other_states_until_the_skill_succeeds() -> None:
    streak = streak_of(5, SuccessRecord(0, 0))
    streak.add(("m", "look"), look(), {"there": True}, 50.0, SuccessRecord(0, 6), {})
    assert streak.reason_to_stop(("m", "look"), {"there": True}, 100.0) == ""
    streak.succeeded(("m", "search"))
    streak.add(("m", "look"), look(), STATE_BEFORE, 55.0, SuccessRecord(0, 7), {})
    assert reason(streak, 60.0) != ""
    streak.succeeded(("m", "look"))
    assert reason(streak, 60.0) == ""
    assert streak.probability_by_chance(LOOK_ID, STATE_BEFORE) == 1.0


# In the agent's loop.

LOOK, GLANCE = look(), look("glance")
FIND = task("find", ("find",), "dumpling_cooked", rule("dumpling_cooked", "look", retry=1))
TASK = "m.find"


def pursued(
    folder: Path, successes: int, providers: Sequence[Skill] = (LOOK,)
) -> tuple[RunReport, FakeRuntime]:
    """A run in which `look` never succeeds and takes 5 s; it succeeded as often as is given before."""
    ecm = module("m", tuple(providers), FIND)
    if len(providers) > 1:
        rules = (replace(FIND.rules[0], skill="seeing"),)
        ecm = replace(
            ecm, capabilities={"seeing": ("look", "glance")}, tasks={"find": replace(FIND, rules=rules)}
        )
    start = dict.fromkeys(PREDICATES, False)
    world = world_from_readings(STATE, {name: Reading(one, 0.0) for name, one in start.items()}, 0.0)
    context = evidence_context(TASK, ecm, providers, world)
    with open_memory(folder / "memory.sqlite3", Identity(uuid4(), "chef", "", 1)) as memory:
        for _ in range(successes):
            begun = EpisodeStart(TASK, "m", "look", "step", {}, 0.0, {}, context)
            ending = EpisodeEnd("finished", "seen", False, "", 5.0, {}, counts_toward_record=True)
            memory.end_episode(memory.start_episode(begun), ending)

    def chance(name: str, _: list[str]) -> str:
        runtime.clock += 4.0
        return "seen" if name == "glance" else "not_seen"

    runtime = FakeRuntime({"m": ecm}, chance=chance, at=site(replans=10))
    with start_agent(folder, "chef", runtime) as agent:
        return agent.run("find"), runtime


def test_the_same_look_is_given_up_within_half_a_minute_and_the_reason_is_in_the_report(
    tmp_path: Path,
) -> None:
    report, runtime = pursued(tmp_path, successes=30)
    assert not report.reached
    assert runtime.submitted == ["look"] * 3
    assert runtime.clock < 130.0  # it began at 100
    assert report.reason is not None
    assert "nothing else is known to try" in report.reason
    assert "it failed 3 times in the same measured state in 15 s, where it had succeeded" in report.reason


def test_without_a_record_no_budget_is_used_on_one_cause(tmp_path: Path) -> None:
    report, runtime = pursued(tmp_path, successes=0)
    assert runtime.submitted == ["look"] * 6
    assert "it failed 6 times in the same measured state in 30 s" in str(report.reason)


def test_another_provider_is_tried_before_the_run_is_given_up(tmp_path: Path) -> None:
    report, runtime = pursued(tmp_path, successes=60, providers=(LOOK, GLANCE))
    assert report.reached
    assert runtime.submitted[-1] == "glance"
