from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from fractions import Fraction
from math import nan
from pathlib import Path
from typing import Any, cast

import pytest

from aeros.runtime.audit.log import AuditError, verify_log
from aeros.runtime.execution import scheduler as module
from aeros.runtime.gate.decision import Decision, DecisionKind, Reason
from aeros.runtime.ports import MotionCompletion, Runtime, StepRequest, StepResult, StepStatus
from aeros.skill import Action, Inputs, Observation, SkillBody, act
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.expr.shortfall import UnmetBound
from aeros.spec.model.cause import Cause, causes_to_json
from aeros.spec.model.site import Site
from tests.unit.runtime.one_step import DENIAL, MakeBench, twice, watched


def test_a_skill_runs_to_its_end(make_bench: MakeBench) -> None:
    bench = make_bench(twice)
    assert bench.submit() == StepResult(StepStatus.FINISHED, "", allowed=2)
    assert bench.plant.executed == [act("move", speed=0.1), act("move", speed=0.2)]
    bench.assert_cleaned_up(finished=True)
    events = [record["event"] for record in bench.records()]
    assert events == ["session-opened", "step-began", "decision", "decision", "step-ended"]


def test_certified_code_is_run_from_its_folder(make_bench: MakeBench) -> None:
    code = "from aeros.skill import act\ndef lift(_, inputs):\n    yield act('move', h=inputs['height'])\n"
    bench = make_bench(code=code)
    assert bench.submit(StepRequest("handling", "lift", {"height": 0.05})).status is StepStatus.FINISHED
    assert bench.plant.executed == [act("move", h=0.05)]


def test_code_that_was_changed_is_refused(make_bench: MakeBench, tmp_path: Path) -> None:
    bench = make_bench(code="def lift(observed, inputs):\n    yield\n")
    (tmp_path / "handling" / "skills.py").write_text("def lift(observed, inputs):\n    yield 1\n")
    result = bench.submit()
    assert result.status is StepStatus.REFUSED
    assert "does not match its certificate" in result.reason


def test_what_was_reduced_is_what_is_executed(make_bench: MakeBench) -> None:
    bench = make_bench(twice)
    slower = act("move", speed=0.05)
    bench.gate.answers = [Decision(DecisionKind.ATTENUATE, slower, (Reason("AE750", "speed", "too fast"),))]
    assert bench.submit() == StepResult(StepStatus.FINISHED, "", allowed=1, attenuated=1)
    assert bench.plant.executed[0] == slower
    first = bench.records("decision")[0]["details"]
    assert (first["asked"]["parameters"], first["decided"]["parameters"]) == ({"speed": 0.1}, {"speed": 0.05})


def test_a_denied_action_halts_the_skill_and_nothing_moves(make_bench: MakeBench) -> None:
    ends: list[str] = []
    bench = make_bench(watched(ends))
    bench.gate.answers = [Decision(DecisionKind.ALLOW, act("move", speed=0.1), ()), DENIAL]
    expected = StepResult(StepStatus.DENIED, "AE750 workspace: outside", allowed=1, denied=1)
    result = bench.submit()
    assert replace(result, causes=()) == expected
    (cause,) = result.causes
    assert (cause.code, cause.rule, cause.text) == ("AE750", "workspace", "outside")
    assert (ends, len(bench.plant.executed)) == (["closed"], 1)
    bench.assert_cleaned_up(finished=False)
    assert bench.records("decision")[-1]["details"]["reasons"] == [["AE750", "workspace", "outside"]]


@pytest.mark.parametrize(
    ("completion", "status", "reason"),
    [
        (MotionCompletion(False, "unreachable: too far"), StepStatus.STOPPED, "unreachable: too far"),
        (MotionCompletion(False), StepStatus.STOPPED, "the plant gave no reason"),
    ],
)
def test_a_motion_that_does_not_complete_halts_the_skill(
    make_bench: MakeBench, completion: MotionCompletion, status: StepStatus, reason: str
) -> None:
    ends: list[str] = []
    bench = make_bench(watched(ends))
    bench.plant.script([completion])
    assert bench.submit() == StepResult(status, reason, allowed=1)
    assert ends == ["closed"]
    bench.assert_cleaned_up(finished=False)


def test_the_monitor_stops_a_motion(make_bench: MakeBench) -> None:
    bench = make_bench(twice)
    bench.plant.during = [{}, {"human_distance": 0.5}]
    result = bench.submit()
    assert replace(result, causes=()) == StepResult(
        StepStatus.STOPPED, "monitor:separation: human_distance is 0.5 m (at least 1 m)", allowed=1
    )
    part = UnmetBound("human_distance", 0.5, "at least", 1.0, "m")
    assert result.causes == (
        Cause("rule", "separation", "human_distance >= 1 m", location="site.yaml:1", shortfalls=(part,)),
    )
    (ended,) = bench.records("step-ended")
    assert ended["details"]["causes"] == json.loads(json.dumps(causes_to_json(result.causes)))
    bench.assert_cleaned_up(finished=False)


def test_a_skill_is_halted_at_its_time_out(make_bench: MakeBench) -> None:
    ends: list[str] = []
    bench = make_bench(watched(ends))
    bench.plant.duration = 4.0
    result = bench.submit()
    assert (result.status, result.allowed) == (StepStatus.TIMED_OUT, 3)
    assert (bench.plant.time, ends) == (10.0, ["closed"])
    bench.assert_cleaned_up(finished=False)


def test_a_skill_that_thinks_past_its_time_out_moves_nothing(make_bench: MakeBench) -> None:
    def slow(observed: Observation, inputs: Inputs) -> SkillBody:
        bench.plant.time = 10.5
        yield act("move")

    bench = make_bench(slow)
    assert bench.submit() == StepResult(StepStatus.TIMED_OUT, "the skill's timeout has passed")
    assert bench.plant.executed == []
    bench.assert_cleaned_up(finished=False)


def test_a_skill_that_finishes_late_has_timed_out(make_bench: MakeBench) -> None:
    def late(observed: Observation, inputs: Inputs) -> SkillBody:
        yield act("move")
        bench.plant.time = 10.5

    bench = make_bench(late)
    assert bench.submit().status is StepStatus.TIMED_OUT
    bench.assert_cleaned_up(finished=False)


def _raises(failure: BaseException) -> Callable[..., Any]:
    def body(observed: Observation, inputs: Inputs) -> SkillBody:
        yield act("move")
        raise failure

    return body


def _yields(what: object) -> Callable[..., Any]:
    def body(observed: Observation, inputs: Inputs) -> Iterator[Any]:
        yield act("move")
        yield what

    return body


class _Mimic(Action):
    pass


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        (_raises(ValueError("no")), "ValueError: no"),
        (_raises(ValueError("\ud800")), "ValueError: "),
        (_raises(SystemExit(0)), "SystemExit: 0"),
        (_raises(GeneratorExit()), "GeneratorExit: "),
        (_raises(StopIteration()), "RuntimeError: generator raised StopIteration"),
        (_raises(AuditError("spoof")), "AuditError: spoof"),
        (_raises(InternalError("spoof")), "InternalError: spoof"),
        (_yields(None), "the skill yielded a `NoneType`, not an action"),
        (_yields(("move", {})), "the skill yielded a `tuple`, not an action"),
        (_yields(_Mimic("move", {})), "the skill yielded a `_Mimic`, not an action"),
        (
            _yields(Action("move", cast("Any", 3))),
            "the skill yielded parameters that are not a dict of at most 64",
        ),
        (
            _yields(Action("move", {f"p{number}": 0.0 for number in range(65)})),
            "the skill yielded parameters that are not a dict of at most 64",
        ),
        (
            _yields(Action(cast("Any", 3), {})),
            "the skill yielded a kind or a parameter name that is not a string",
        ),
        (_yields(Action("move", cast("Any", {3: 1}))), "the skill yielded a kind or a parameter name"),
    ],
)
def test_code_that_fails_halts_the_skill(
    make_bench: MakeBench, body: Callable[..., Any], reason: str
) -> None:
    bench = make_bench(body)
    result = bench.submit()
    assert (result.status, result.allowed) == (StepStatus.RAISED, 1)
    assert result.reason.startswith(reason)
    bench.assert_cleaned_up(finished=False)
    assert bench.records("step-ended")[0]["details"]["status"] == "raised"


def test_code_that_does_not_take_its_arguments_is_halted(make_bench: MakeBench) -> None:
    bench = make_bench(lambda: None)
    assert bench.submit().status is StepStatus.RAISED
    bench.assert_cleaned_up(finished=False)


def test_a_skill_that_floods_is_halted(make_bench: MakeBench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MAX_ACTIONS", 20)
    ends: list[str] = []
    bench = make_bench(watched(ends))
    bench.plant.duration = 0.0
    result = bench.submit()
    assert (result.status, result.allowed, ends) == (StepStatus.RAISED, 20, ["closed"])
    assert "asked for more than" in result.reason
    bench.assert_cleaned_up(finished=False)


def test_clean_up_that_raises_is_told_and_stops_nothing_else(make_bench: MakeBench) -> None:
    def stubborn(observed: Observation, inputs: Inputs) -> SkillBody:
        try:
            yield act("move")
        finally:
            raise ValueError("mine")

    bench = make_bench(stubborn)
    bench.gate.answers = [DENIAL]
    result = bench.submit()
    assert result.status is StepStatus.DENIED
    assert result.reason.endswith("and its own clean-up raised ValueError: mine")
    bench.assert_cleaned_up(finished=False)


@pytest.mark.parametrize(
    ("request_", "reason"),
    [
        (StepRequest("absent", "lift", {}), "no module `absent` is active"),
        (StepRequest("handling", "absent", {}), "module `handling` has no skill `absent`"),
        (StepRequest(cast("Any", []), "lift", {}), "module and skill are not both names"),
        (StepRequest("handling", "lift", cast("Any", 3)), "the inputs are not a mapping"),
        (StepRequest("handling", "lift", {"depth": 1.0}), "the skill has no input `depth`"),
        (
            StepRequest("handling", "lift", cast("Any", {1: 1})),
            "the skill has no input whose name is not a string",
        ),
        (StepRequest("handling", "lift", {"height": None}), "the input `height` is missing"),
        (StepRequest("handling", "lift", {"height": nan}), "the input `height` is not a finite number"),
        (StepRequest("handling", "lift", {"height": True}), "the input `height` is not a finite number"),
        (StepRequest("handling", "lift", {"height": "1"}), "the input `height` is not a finite number"),
        (StepRequest("handling", "lift", {"height": 0.11}), "outside its range [0, 0.1]"),
        (StepRequest("handling", "lift", {"height": -1}), "outside its range [0, 0.1]"),
        (StepRequest("handling", "lift", {"careful": 1}), "the input `careful` is not a truth value"),
        (StepRequest("handling", "lift", {"side": "up"}), "the input `side` is not one of left, right"),
    ],
)
def test_a_bad_request_is_refused_and_recorded(
    make_bench: MakeBench, request_: StepRequest, reason: str
) -> None:
    bench = make_bench(twice)
    result = bench.submit(request_)
    assert result.status is StepStatus.REFUSED
    assert reason in result.reason
    assert bench.plant.calls == []
    assert bench.records("step-refused")[0]["details"]["reason"] == result.reason


def test_defaults_are_filled_in_inside_their_range(make_bench: MakeBench) -> None:
    bench = make_bench(twice)
    bench.submit(StepRequest("handling", "lift", {"side": "right"}))
    inputs = bench.gate.asked[0][0].inputs
    # The double nearest to 1/10 is above 1/10.
    assert inputs == {"height": 0.09999999999999999, "careful": True, "side": "right"}
    assert Fraction(inputs["height"]) <= Fraction(1, 10)


def test_a_skill_cannot_change_what_it_is_judged_by(
    make_bench: MakeBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = [0.1, 0.2, 0.3]
    parameters: dict[str, Any] = {"speed": 0.1, "target": target}

    def sly(observed: Observation, inputs: Inputs) -> SkillBody:
        cast("dict[str, Any]", inputs)["height"] = 99.0
        cast("dict[str, Any]", observed)["holding"] = True
        yield Action("move", parameters)

    bench = make_bench(sly)
    decide = bench.gate.decide

    def meanwhile(*arguments: Any) -> Decision:
        parameters["speed"] = target[2] = 99.0
        return decide(*arguments)

    monkeypatch.setattr(bench.gate, "decide", meanwhile)
    assert bench.submit().status is StepStatus.FINISHED
    caller, readings, action, _, _ = bench.gate.asked[0]
    assert caller.inputs["height"] < 1
    assert readings["holding"].value is False
    assert bench.plant.executed == [action] == [act("move", speed=0.1, target=(0.1, 0.2, 0.3))]


def test_a_skill_sees_what_its_module_may_sense_while_it_is_fresh(make_bench: MakeBench) -> None:
    seen: list[Observation] = []

    def looking(observed: Observation, inputs: Inputs) -> SkillBody:
        seen.append(observed)
        for stale in (0.0625, 0.11, -0.01):
            bench.plant.reading_age = stale
            seen.append((yield act("move")))

    bench = make_bench(looking)
    bench.submit()
    allowed = {"tool_position": (0.3, 0.0, 0.5), "holding": False}
    assert seen == [allowed, allowed, {}, {}]


def test_the_gate_is_asked_with_readings_of_now_and_the_usage_so_far(make_bench: MakeBench) -> None:
    bench = make_bench(twice)
    bench.submit()
    assert [usage for *_, usage in bench.gate.asked] == [{"move-rate": 0}, {"move-rate": 1}]
    for _, readings, _, now, _ in bench.gate.asked:
        assert readings["holding"].time == now


def test_a_clock_that_goes_back_denies(make_bench: MakeBench) -> None:
    def rewinding(observed: Observation, inputs: Inputs) -> SkillBody:
        yield act("move")
        bench.plant.time = -1.0
        yield act("move")

    bench = make_bench(rewinding)
    result = bench.submit()
    assert (result.status, result.allowed, result.denied) == (StepStatus.DENIED, 1, 1)
    assert "the clock went back" in result.reason
    bench.assert_cleaned_up(finished=False)


def test_strange_parameters_are_recorded_and_denied(make_bench: MakeBench) -> None:
    bench = make_bench(_yields(act("move", speed=nan, more=[object()], huge="x" * 2_000_000)))
    bench.gate.answers = [Decision(DecisionKind.ALLOW, act("move"), ()), DENIAL]
    assert bench.submit().status is StepStatus.DENIED
    details = bench.records("decision")[-1]["details"]
    assert details["verdict"] == "DENY"
    assert details["asked"]["parameters"]["speed"] == {"float": "nan"}
    assert details["asked"]["parameters"]["huge"] == {"unencodable": "too large"}


def test_a_decision_record_holds_what_was_decided_on(make_bench: MakeBench) -> None:
    bench = make_bench(twice)
    bench.submit()
    details = bench.records("decision")[0]["details"]
    assert details["configuration"] == "c" * 64
    assert (details["module"], details["skill"], details["verdict"]) == ("handling", "lift", "ALLOW")
    assert details["state"]["tool_position"] == [[0.3, 0.0, 0.5], 0.0]
    assert len(details["state_digest"]) == 64


def test_it_is_the_runtime_that_the_agent_sees(make_bench: MakeBench, site: Site) -> None:
    bench = make_bench(twice)
    runtime: Runtime = bench.executor
    assert runtime.site is site
    assert list(runtime.active_modules()) == ["handling"]
    assert runtime.now() == 0.0
    assert runtime.observe()["holding"].value is False
    runtime.note("decision", {"verdict": "ALLOW"})
    note = bench.records("note")[0]["details"]
    assert note == {"event": "decision", "details": {"verdict": "ALLOW"}}
    assert verify_log(bench.log_path).decisions.allowed == 0
