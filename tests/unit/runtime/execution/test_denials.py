"""Actions that did not begin: the skill asks for another one, or its step ends with every reason."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import pytest

from aeros.runtime.execution import scheduler as module
from aeros.runtime.execution.denials import MAX_DENIALS
from aeros.runtime.gate.decision import Decision, DecisionKind, Reason
from aeros.runtime.ports import MotionCompletion, StepResult, StepStatus
from aeros.skill import ActionDenied, Inputs, Observation, SkillBody, act, first_allowed
from aeros.spec.expr.shortfall import UnmetBound
from aeros.spec.model.cause import Cause
from tests.unit.runtime.one_step import DENIAL, MakeBench

FINISHED = StepStatus.FINISHED


def in_two_ways(observed: Observation, inputs: Inputs) -> SkillBody:
    def way(speed: float) -> Any:
        def move_at(_: Observation) -> Any:
            return (yield act("move", speed=speed))

        return move_at

    yield from first_allowed(observed, way(0.3), way(0.1))
    yield act("move")


def test_a_skill_that_is_denied_one_way_goes_another(make_bench: MakeBench) -> None:
    bench = make_bench(in_two_ways)
    bench.gate.answers = [DENIAL]
    result = bench.submit()
    assert (result.status, result.allowed, result.denied) == (FINISHED, 2, 1)
    assert bench.plant.executed == [act("move", speed=0.1), act("move")]
    bench.assert_cleaned_up(finished=True)


def test_a_skill_that_is_denied_every_way_ends_with_the_reasons_of_all(make_bench: MakeBench) -> None:
    bench = make_bench(in_two_ways)
    other = Decision(DecisionKind.DENY, None, (Reason("AE750", "fence", "too near"),))
    bench.gate.answers = [other, DENIAL]
    result = bench.submit()
    assert (result.status, result.denied, result.denials) == (StepStatus.DENIED, 2, 2)
    assert not result.is_transient
    assert result.reason == "AE750 workspace: outside; in other ways before: 1 by fence"
    assert [cause.rule for cause in result.causes] == ["workspace", "fence"]
    assert bench.plant.executed == []
    bench.assert_cleaned_up(finished=False)


def test_a_denial_that_another_way_made_up_for_is_no_reason_of_a_later_one(make_bench: MakeBench) -> None:
    bench = make_bench(in_two_ways)
    other = Decision(DecisionKind.DENY, None, (Reason("AE750", "fence", "too near"),))
    bench.gate.answers = [other, Decision(DecisionKind.ALLOW, act("move", speed=0.1), ()), DENIAL]
    result = bench.submit()
    assert (result.status, result.denied, result.denials) == (StepStatus.DENIED, 2, 1)
    assert result.reason == "AE750 workspace: outside"
    assert [cause.rule for cause in result.causes] == ["workspace"]


def test_a_skill_that_finishes_in_spite_of_a_denial_has_its_cause(make_bench: MakeBench) -> None:
    def content(observed: Observation, inputs: Inputs) -> SkillBody:
        with suppress(ActionDenied):
            yield act("move")

    bench = make_bench(content)
    bench.gate.answers = [DENIAL]
    result = bench.submit()
    assert (result.status, [cause.rule for cause in result.causes]) == (FINISHED, ["workspace"])
    assert "causes" not in bench.records("step-ended")[0]


def test_an_action_that_the_robot_cannot_do_counts_as_a_denied_way_too(
    make_bench: MakeBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = make_bench(in_two_ways)
    begin, refusals = bench.plant.begin, [MotionCompletion(completed=False, reason="out of reach")]
    monkeypatch.setattr(bench.plant, "begin", lambda *given: refusals.pop() if refusals else begin(*given))
    assert bench.submit().status is FINISHED
    assert bench.plant.executed == [act("move", speed=0.1), act("move")]


def test_a_denial_that_may_pass_ends_the_step_without_another_way(
    make_bench: MakeBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "is_transient_denial", lambda *_: True)
    bench = make_bench(in_two_ways)
    bench.gate.answers = [DENIAL]
    result = bench.submit()
    assert (result.status, result.is_transient, result.denied) == (StepStatus.DENIED, True, 1)


def test_a_skill_that_raises_a_denial_which_never_was_has_a_mistake(make_bench: MakeBench) -> None:
    def liar(observed: Observation, inputs: Inputs) -> SkillBody:
        denial = ActionDenied("so I say", observed)
        if str(denial):
            raise denial
        yield act("move")

    assert make_bench(liar).submit() == StepResult(
        StepStatus.RAISED, "the skill raised `ActionDenied`, but nothing was denied"
    )


def test_a_skill_that_goes_on_after_every_denial_is_ended(make_bench: MakeBench) -> None:
    def stubborn(observed: Observation, inputs: Inputs) -> SkillBody:
        while True:
            with suppress(ActionDenied):
                yield act("move")

    bench = make_bench(stubborn)
    bench.gate.answers = [DENIAL] * (2 * MAX_DENIALS)
    result = bench.submit()
    assert (result.status, result.denied) == (StepStatus.DENIED, MAX_DENIALS)
    assert result.reason.endswith(f"{MAX_DENIALS} denials, the most in one step")
    assert len(bench.records("decision")) == MAX_DENIALS
    bench.assert_cleaned_up(finished=False)


def test_a_denial_names_rules_to_the_skill_and_no_values_that_it_may_not_sense(
    make_bench: MakeBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    part = UnmetBound("human_distance", 0.41, "at least", 0.5, "m")
    causes = (Cause("rule", "separation", "", shortfalls=(part,), code="AE750"),)
    asked = list[str]()

    def curious(observed: Observation, inputs: Inputs) -> SkillBody:
        try:
            yield act("move")
        except ActionDenied as denied:
            asked.append(str(denied))
            raise

    monkeypatch.setattr("aeros.runtime.execution.decision_pipeline.denial_causes", lambda *_: causes)
    bench = make_bench(curious)
    bench.gate.answers = [DENIAL]
    assert "0.41" in bench.submit().reason
    assert asked == ["AE750 separation"]
