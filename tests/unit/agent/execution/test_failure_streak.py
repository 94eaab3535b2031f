"""A streak of declared failures is given up only where chance does not explain it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from uuid import uuid4

from aeros.agent.agent import start_agent
from aeros.agent.execution.failure_streak import (
    LEAST_SECONDS,
    FailureStreak,
    Quantities,
    quantities_of,
)
from aeros.agent.execution.report import RunReport
from aeros.agent.identity import Identity
from aeros.agent.memory.context import evidence_context
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
    times: int,
    *others: str,
    expected: Fraction = Fraction(1, 20),
    quantities: Sequence[Quantities] = ({},),
) -> FailureStreak:
    """As many failures of `look`, and of each of the others; after each, a quantity is measured, in turn."""
    streak = FailureStreak()
    for number in range(times):
        measured = quantities[number % len(quantities)]
        for name in ("look", *others):
            streak.add(("m", name), expected, STATE_BEFORE, 5.0 * number, measured)
    return streak


def test_a_skill_is_given_up_at_the_failure_that_chance_does_not_explain() -> None:
    assert reason(streak_of(5), 1e4) == ""
    assert reason(streak_of(6), 30.0) == (
        "it failed 6 times in the same measured state in 30 s, where 5.0% of tries are to fail"
    )
    assert reason(streak_of(3, expected=Fraction(1, 50)), 1e4) == ""
    assert reason(streak_of(4, expected=Fraction(1, 50)), 1e4) != ""
    assert reason(streak_of(33, expected=Fraction(9, 10)), 1e4) == ""


def test_the_last_tries_come_after_a_pause() -> None:
    assert streak_of(2).pause(LOOK_ID, STATE_BEFORE, 2.0) == 0.0
    assert streak_of(20, expected=Fraction(9, 10)).pause(LOOK_ID, STATE_BEFORE, 2.0) == 0.0
    thrice = streak_of(3)
    assert thrice.pause(LOOK_ID, STATE_BEFORE, 9.0) == LEAST_SECONDS - 9.0
    assert thrice.pause(LOOK_ID, STATE_BEFORE, 16.0) == 0.0
    assert thrice.pause(LOOK_ID, {"there": True}, 9.0) == 0.0
    assert thrice.pause(("m", "search"), STATE_BEFORE, 9.0) == 0.0


def test_failures_that_change_something_count_by_skill() -> None:
    places: tuple[Quantities, ...] = ({"place": (0.0, 0.0)}, {"place": (0.0, 1.5)})
    assert reason(streak_of(5, quantities=places), 1e4) == ""
    assert "it failed 6 times" in reason(streak_of(6, quantities=places), 1e4)
    # Within its uncertainty nothing has changed.
    rest: tuple[Quantities, ...] = ({"place": (0.0, 0.0)}, {"place": (0.0, 0.9)})
    assert "6 times in the same measured state in 30 s, and no measured quantity changed" in (
        reason(streak_of(6, quantities=rest), 30.0)
    )


def test_another_skill_that_helped_a_little_is_no_evidence() -> None:
    places: tuple[Quantities, ...] = ({"place": (0.0,)}, {"place": (2.0,)})
    assert reason(streak_of(3, "push", quantities=places), 1e4) == ""


def test_quantities_are_in_units_of_their_uncertainty() -> None:
    variable = t.Variable("m.at", VectorType(LENGTH), t.VariableRole.STATE)
    at, bare = Declared(variable, SPAN, uncertainty=Fraction(1, 100)), Declared(variable, SPAN)
    found = quantities_of({"m.at": (1, Fraction(1, 2), 0), "m.bare": (1, 1, 1)}, {"m.at": at, "m.bare": bare})
    assert found == {"m.at": (100.0, 50.0, 0.0)}
    assert quantities_of({}, {"m.at": at}) == {}


def test_the_failures_of_several_count_together() -> None:
    assert "`m.search` 3 times did not help" in reason(streak_of(3, "search"), 15.0)
    assert reason(streak_of(3, "search", expected=Fraction(9, 10)), 100.0) == ""


def test_a_streak_lasts_through_other_states_until_the_skill_succeeds() -> None:
    streak = streak_of(5)
    streak.add(LOOK_ID, Fraction(1, 20), {"there": True}, 50.0, {})
    assert streak.reason_to_stop(LOOK_ID, {"there": True}, 100.0) == ""
    streak.succeeded(("m", "search"))
    streak.add(LOOK_ID, Fraction(1, 20), STATE_BEFORE, 55.0, {})
    assert reason(streak, 60.0) != ""
    streak.succeeded(LOOK_ID)
    assert reason(streak, 60.0) == ""


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
    assert runtime.submitted == ["look"] * 4
    assert runtime.clock < 130.0  # it began at 100
    assert report.reason is not None
    assert "nothing else is known to try" in report.reason
    assert "it failed 4 times in the same measured state in 25 s, where 1.7% of tries" in report.reason


def test_without_a_record_no_budget_is_used_on_one_cause(tmp_path: Path) -> None:
    report, runtime = pursued(tmp_path, successes=0)
    assert runtime.submitted == ["look"] * 6
    assert "it failed 6 times in the same measured state in 30 s" in str(report.reason)


def test_a_run_that_met_a_cause_does_not_make_the_next_try_longer(tmp_path: Path) -> None:
    for _ in range(3):
        report, runtime = pursued(tmp_path, successes=0)
        assert runtime.submitted == ["look"] * 6
        assert not report.reached


def test_another_provider_is_tried_before_the_run_is_given_up(tmp_path: Path) -> None:
    report, runtime = pursued(tmp_path, successes=60, providers=(LOOK, GLANCE))
    assert report.reached
    assert runtime.submitted[-1] == "glance"
