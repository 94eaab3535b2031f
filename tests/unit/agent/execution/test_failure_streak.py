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
from aeros.agent.execution.failure_streak import LEAST_CHANCE, FailureStreak
from aeros.agent.execution.report import RunReport
from aeros.agent.identity import Identity
from aeros.agent.memory.context import evidence_context
from aeros.agent.memory.posterior import SuccessRecord
from aeros.agent.memory.store import EpisodeEnd, EpisodeStart, open_memory
from aeros.agent.world.world import world_from_readings
from aeros.runtime.ports import Reading
from aeros.spec.model.ecm import Skill
from tests.unit.agent.dumplings import PREDICATES, STATE, module, outcome, rule, site, skill, task
from tests.unit.agent.fake_runtime import FakeRuntime


def look(name: str = "look", failure: Fraction = Fraction(1, 20)) -> Skill:
    seen = replace(outcome("seen", {"dumpling_cooked": True}), probability=1 - failure)
    return skill(name, seen, replace(outcome("not_seen", {}, failure=True), probability=failure))


def streak_of(times: int, record: SuccessRecord, *others: str) -> FailureStreak:
    """As many failures of `look`, which had this record before, and of each of the others, which had none."""
    streak = FailureStreak()
    for number in range(times):
        now = SuccessRecord(record.successes, record.failures + number + 1)
        streak.add(("m", "look"), look(), {"there": False}, 5.0 * number, now)
        for other in others:
            streak.add(
                ("m", other), look(other), {"there": False}, 5.0 * number, SuccessRecord(0, number + 1)
            )
    return streak


@given(st.integers(1, 9), st.integers(0, 50), st.integers(0, 50))
def test_the_probability_of_one_skill_alone_is_that_of_its_record(
    times: int, successes: int, failures: int
) -> None:
    streak = streak_of(times, SuccessRecord(successes, failures))
    exact = prod((failures + 1 + i) / (successes + failures + 2 + i) for i in range(times))
    assert streak.probability_by_chance() == pytest.approx(exact)


def test_a_skill_without_a_record_is_never_given_up_by_itself() -> None:
    assert streak_of(40, SuccessRecord(0, 0)).reason_to_stop(("m", "look"), 1e4) == ""


def test_a_skill_that_succeeded_often_is_given_up_after_three_failures_and_not_after_two() -> None:
    record = SuccessRecord(20, 0)
    assert streak_of(2, record).reason_to_stop(("m", "look"), 100.0) == ""
    assert streak_of(3, record).reason_to_stop(("m", "look"), 14.9) == ""  # too soon
    assert streak_of(3, record).reason_to_stop(("m", "look"), 20.0) == (
        "it failed 3 times in the same measured state in 20 s, "
        "where it had succeeded in 20 of 20 tries before"
    )
    # A skill that often fails has more tries.
    assert streak_of(5, SuccessRecord(6, 6)).reason_to_stop(("m", "look"), 100.0) == ""


def test_the_failure_of_several_counts_as_they_declare_it() -> None:
    streak = streak_of(3, SuccessRecord(0, 0), "search")
    assert streak.probability_by_chance() < LEAST_CHANCE
    assert streak.reason_to_stop(("m", "look"), 15.0) == (
        "it failed 3 times in the same measured state in 15 s; `m.search` 3 times did not help"
    )
    often = FailureStreak()
    for name in ("look", "search") * 3:
        often.add(("m", name), look(name, Fraction(9, 10)), {}, 0.0, SuccessRecord(0, 1))
    assert often.reason_to_stop(("m", "look"), 100.0) == ""


def test_another_state_and_a_success_begin_a_new_streak() -> None:
    streak = streak_of(5, SuccessRecord(20, 0))
    assert streak.probability_by_chance() < LEAST_CHANCE
    streak.add(("m", "look"), look(), {"there": True}, 50.0, SuccessRecord(20, 6))
    assert streak.began == 50.0
    assert streak.reason_to_stop(("m", "look"), 100.0) == ""
    streak.reset()
    assert streak.probability_by_chance() == 1.0


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


def test_without_a_record_the_whole_budget_is_used(tmp_path: Path) -> None:
    report, runtime = pursued(tmp_path, successes=0)
    assert len(runtime.submitted) == 22
    assert "after 10 re-plans" in str(report.reason)


def test_another_provider_is_tried_before_the_run_is_given_up(tmp_path: Path) -> None:
    report, runtime = pursued(tmp_path, successes=60, providers=(LOOK, GLANCE))
    assert report.reached
    assert runtime.submitted[-1] == "glance"
