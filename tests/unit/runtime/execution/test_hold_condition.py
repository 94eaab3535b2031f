"""A skill's hold condition is checked as long as it runs; a violated or unknown one halts the skill."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.execution.hold_condition import hold_conditions_for
from aeros.runtime.ports import MotionCompletion, Reading, StepResult, StepStatus
from aeros.skill import Inputs, Observation, SkillBody, act
from aeros.spec.expr import terms as t
from aeros.spec.expr.shortfall import UnmetBound
from aeros.spec.model.cause import file_and_line
from aeros.spec.model.ecm import ActionCondition, Ecm
from aeros.spec.model.site import Site
from tests.unit.runtime.conftest import METRES
from tests.unit.runtime.one_step import STEP, Bench, twice, watched


def holding(site: Site, ecm: Ecm) -> Ecm:
    """`lift` holds to `holding and human_distance >= 2 m`."""
    far = t.Compare("<=", t.Literal(Fraction(2), METRES), site.state["human_distance"].variable)
    term = t.And((site.state["holding"].variable, far))
    clause = ActionCondition(term, "holding and human_distance >= 2 m", site.span)
    return replace(ecm, skills={"lift": replace(ecm.skills["lift"], hold_condition=clause)})


@pytest.fixture
def bench(site: Site, make_ecm: Any, tmp_path: Path) -> Bench:
    bench = Bench(site, holding(site, make_ecm("")), tmp_path / "audit.jsonl", twice)
    bench.plant.values["holding"] = True
    return bench


def message(result: StepResult) -> list[str]:
    (cause,) = result.causes
    assert (cause.kind, cause.rule) == ("hold", "handling.lift")
    return [str(one) for one in cause.shortfalls]


def test_a_condition_that_always_holds_changes_nothing(bench: Bench) -> None:
    assert bench.submit() == StepResult(StepStatus.FINISHED, "", allowed=2)
    bench.assert_cleaned_up(finished=True)


@pytest.mark.parametrize(
    ("tick", "why"),
    [
        ({"holding": False}, ["holding is false"]),
        ({"human_distance": 1.5}, ["human_distance is 1.5 m (at least 2 m)"]),
        (
            {"holding": False, "human_distance": 1.5},
            ["holding is false", "human_distance is 1.5 m (at least 2 m)"],
        ),
        ({"holding": 1}, ["`holding` is not true or false"]),
        ({"human_distance": float("nan")}, ["`human_distance` is not finite"]),
        ({"holding": Reading(True, -0.2)}, ["`holding` is 0.2 s old; at most 0.1 s is allowed"]),
        ({"holding": Reading(True, 5.0)}, ["`holding` was measured in the future"]),
    ],
)  # fmt: skip
def test_a_tick_at_which_it_does_not_hold_halts_the_motion_and_the_skill(
    bench: Bench, tick: dict[str, Any], why: list[str]
) -> None:
    bench.plant.during = [{}, tick]
    result = bench.submit()
    assert result.status is StepStatus.HOLD_LOST
    assert message(result) == why
    assert bench.plant.call_count("halt") == 1
    bench.assert_cleaned_up(finished=False)
    (ended,) = bench.records("step-ended")
    assert ended["details"]["status"] == "unheld"
    assert ended["details"]["causes"][0]["text"] == "holding and human_distance >= 2 m"


def test_a_condition_on_other_variables_observes_them_at_the_tick(
    site: Site, make_ecm: Any, tmp_path: Path
) -> None:
    one = Bench(site, holding(site, make_ecm("")), tmp_path / "audit.jsonl", twice)
    one.plant.values["holding"] = True

    def monitored(monitor: Any, until: float) -> Any:
        one.plant.calls.append(("advance", until))
        seen = {"human_distance": 20.0}
        assert monitor(one.plant.now(), seen) is None
        assert one.plant.call_count("halt") == 0
        one.plant.values["holding"] = False
        assert monitor(one.plant.now(), seen) is None
        assert one.plant.call_count("halt") == 1
        return dict.fromkeys(one.plant._halted, MotionCompletion(False, "halted"))

    one.plant.advance = monitored  # type: ignore[method-assign]
    result = one.submit()
    assert result.status is StepStatus.HOLD_LOST
    assert message(result) == ["holding is false"]


def test_a_skill_whose_condition_does_not_hold_at_its_beginning_asks_for_nothing(bench: Bench) -> None:
    bench.plant.values["holding"] = False
    assert bench.submit().status is StepStatus.HOLD_LOST
    assert bench.plant.executed == []
    assert bench.gate.asked == []


def test_a_condition_that_breaks_while_the_skill_computes_lets_no_action_begin(
    site: Site, make_ecm: Any, tmp_path: Path
) -> None:
    def lift(observed: Observation, inputs: Inputs) -> SkillBody:
        one.plant.values["holding"] = False
        yield act("move", speed=0.1)

    one = Bench(site, holding(site, make_ecm("")), tmp_path / "audit.jsonl", lift)
    one.plant.values["holding"] = True
    assert one.submit().status is StepStatus.HOLD_LOST
    assert one.plant.executed == []


def test_a_silent_sensor_is_no_condition_that_holds(bench: Bench) -> None:
    del bench.plant.values["holding"]
    result = bench.submit()
    assert message(result) == ["`holding` is not measured"]


def test_a_halted_skill_runs_its_own_clean_up_once(site: Site, make_ecm: Any, tmp_path: Path) -> None:
    ends: list[str] = []
    bench = Bench(site, holding(site, make_ecm("")), tmp_path / "audit.jsonl", watched(ends))
    bench.plant.values["holding"] = True
    bench.plant.during = [{"holding": False}]
    assert bench.submit().status is StepStatus.HOLD_LOST
    assert ends == ["closed"]


def test_a_rule_broken_between_two_actions_is_noticed_before_the_skill_continues(
    site: Site, make_ecm: Any, tmp_path: Path
) -> None:
    resumed = []

    def lift(observed: Observation, inputs: Inputs) -> SkillBody:
        for number in range(3):
            resumed.append(number)
            yield act("move", speed=0.1)

    one = Bench(site, holding(site, make_ecm("")), tmp_path / "audit.jsonl", lift)
    one.plant.values["holding"] = True
    ends = one.plant.advance

    def ends_with_the_hand_empty(monitor: Any, until: float) -> Any:
        over = ends(monitor, until)
        one.plant.values["holding"] = False
        return over

    one.plant.advance = ends_with_the_hand_empty  # type: ignore[method-assign]
    assert one.submit().status is StepStatus.HOLD_LOST
    assert resumed == [0]


def test_the_plant_is_asked_only_for_what_a_tick_does_not_measure(site: Site, make_ecm: Any) -> None:
    skill = holding(site, make_ecm("")).skills["lift"]
    (hold,) = hold_conditions_for(site, "handling", skill, {})
    asked = []

    def observe() -> dict[str, Reading]:
        asked.append(True)
        return {"human_distance": Reading(3.0, 1.0)}

    assert hold.violation_at_tick({"holding": True, "human_distance": 3.0}, 1.0, observe) is None
    assert asked == []
    assert hold.violation_at_tick({"holding": True}, 1.0, observe) is None
    assert asked == [True]
    cause = hold.violation_at_tick({"holding": False}, 1.0, observe)
    assert cause is not None
    assert cause.location == file_and_line(site.span) != ""
    unread = hold.violation_at_tick({"holding": True}, 1.0, dict)
    assert unread is not None
    assert unread.shortfalls == (UnmetBound("human_distance", None, "known", True, reason="is not measured"),)
    (alone,) = hold_conditions_for(site, "handling", replace(skill, inputs={}), {})
    assert alone.violation({"holding": Reading(True, 1.0), "human_distance": Reading(3.0, 1.0)}, 1.0) is None


def test_a_step_that_waits_is_not_halted_by_its_condition_before_its_turn(bench: Bench) -> None:
    steps = [bench.executor.start(STEP), bench.executor.start(STEP)]
    bench.plant.during = [{"holding": False}]
    for step in steps:
        ended = bench.executor.wait()
        assert ended is not None
        assert (ended.step, ended.result.status, ended.result.allowed) == (step, StepStatus.HOLD_LOST, 1)


def test_a_condition_of_a_step_that_has_ended_is_not_checked_again(bench: Bench) -> None:
    for _ in range(2):
        assert bench.submit() == StepResult(StepStatus.FINISHED, "", allowed=2)


def beside(bench: Bench, text: str, term: t.Term) -> Any:
    """A request for `lift` in a part of a plan that holds a condition on the state."""
    return replace(STEP, held=(ActionCondition(t.TRUE, "true", bench_span(bench)), clause(bench, text, term)))


def bench_span(bench: Bench) -> Any:
    return bench.executor.site.span


def clause(bench: Bench, text: str, term: t.Term) -> ActionCondition:
    return ActionCondition(term, text, bench_span(bench))


@pytest.mark.parametrize("tick", [{"holding": False}, {"holding": 1}, {"holding": Reading(True, -0.2)}])
def test_a_condition_of_a_part_around_a_step_cancels_it_and_says_which_it_is(
    site: Site, make_ecm: Any, tmp_path: Path, tick: dict[str, Any]
) -> None:
    bench = Bench(site, make_ecm(""), tmp_path / "audit.jsonl", twice)
    bench.plant.values["holding"] = True
    bench.plant.during = [{}, tick]
    result = bench.submit(beside(bench, "holding", site.state["holding"].variable))
    assert (result.status, result.lost_hold) == (StepStatus.CANCELLED, 1)
    assert [one.text for one in result.causes] == ["holding"]
    assert bench.plant.call_count("halt") == 1
    bench.assert_cleaned_up(finished=False)


def test_a_condition_of_a_part_that_holds_changes_nothing_and_one_that_does_not_lets_no_action_begin(
    site: Site, make_ecm: Any, tmp_path: Path
) -> None:
    bench = Bench(site, make_ecm(""), tmp_path / "audit.jsonl", twice)
    bench.plant.values["holding"] = True
    request = beside(bench, "holding", site.state["holding"].variable)
    assert bench.submit(request) == StepResult(StepStatus.FINISHED, "", allowed=2)
    bench.plant.values["holding"] = False
    result = bench.submit(request)
    assert (result.status, result.lost_hold, result.allowed) == (StepStatus.CANCELLED, 1, 0)
