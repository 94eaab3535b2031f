from __future__ import annotations

import json
from contextlib import AbstractContextManager
from dataclasses import replace
from math import inf
from types import SimpleNamespace
from typing import Any, cast

import pytest

from aeros.runtime.audit.log import DecisionCounts, verify_log
from aeros.runtime.execution.executor import Executor
from aeros.runtime.execution.governor import OperatorCommand
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.decision import Decision, DecisionKind, Reason
from aeros.runtime.gate.gate import CompiledGate, GateMode
from aeros.runtime.ports import (
    EndedStep,
    MotionCompletion,
    Obstacle,
    Runtime,
    StepRequest,
    StepResult,
    StepStatus,
)
from aeros.runtime.skills.in_process_run import run_in_process
from aeros.skill import Action, Inputs, Observation, SkillBody, act
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.expr.shortfall import UnmetBound
from aeros.spec.model.cause import Cause, causes_to_json
from aeros.spec.model.site import Site
from tests.unit.runtime.one_step import DENIAL, STEP, MakeBench, twice, watched
from tests.unit.runtime.together import MakeCart, Operator, asking, configuration, move, roll


def test_a_skill_runs_to_its_end(make_bench: MakeBench) -> None:
    bench = make_bench(twice)
    assert bench.submit() == StepResult(StepStatus.FINISHED, "", allowed=2)
    assert bench.plant.executed == [act("move", speed=0.1), act("move", speed=0.2)]
    bench.assert_cleaned_up(finished=True)
    events = [record["event"] for record in bench.records()]
    assert events == ["session-opened", "step-began", "decision", "decision", "step-ended"]


def test_the_attenuated_action_is_the_executed_one(make_bench: MakeBench) -> None:
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
    reason = "AE750 workspace: outside"
    expected = StepResult(StepStatus.DENIED, reason, allowed=1, denied=1, denials=1)
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
    obstacle = Obstacle("box", (0.0, 0.0, 0.0), (0.1, 0.1, 0.1), 0.0, "overhead", "bench")
    cast("Any", bench.plant).obstacles = lambda: (obstacle,)
    assert runtime.obstacles() == (obstacle,)
    runtime.note("decision", {"verdict": "ALLOW"})
    note = bench.records("note")[0]["details"]
    assert note == {"event": "decision", "details": {"verdict": "ALLOW"}}
    assert verify_log(bench.log_path).decisions.allowed == 0


def test_a_wait_may_end_without_its_event(cart: MakeCart) -> None:
    one = cart(reach=asking(move()))
    one.plant.duration = 4.0
    reach = one.start("reach")
    assert one.executor.wait(3.0) is None
    assert one.plant.time == 3.0
    assert one.executor.wait(3.0) is None
    assert one.executor.wait(5.0) == EndedStep(reach, StepResult(StepStatus.FINISHED, "", allowed=1))


def test_waiting_for_nothing_is_a_mistake(cart: MakeCart) -> None:
    with pytest.raises(MisuseError, match=r"^no step was started, so none can end$"):
        cart().executor.wait()


def test_waiting_for_a_time_lets_it_come_where_nothing_was_started(cart: MakeCart) -> None:
    one = cart()
    assert one.executor.wait(2.5) is None
    assert one.plant.time == 2.5


def test_one_step_can_be_waited_for_while_another_goes_on(cart: MakeCart) -> None:
    one = cart(reach=asking(move()), drive=asking(roll(), roll()))
    drive = one.start("drive")
    assert one.executor.run_step(StepRequest("cart", "reach", {})).status is StepStatus.FINISHED
    assert one.executor.wait() == EndedStep(drive, StepResult(StepStatus.FINISHED, "", allowed=2))


def test_under_another_configuration_nothing_begins_before_what_moves_has_ended(cart: MakeCart) -> None:
    operator = Operator()
    one = cart(governor=operator, reach=asking(move(), move()), drive=asking(roll(), roll()))
    one.plant.durations = [1.0, 3.0]
    one.start("reach")
    one.start("drive")
    assert one.executor.wait(0.5) is None
    operator.generation = 1
    operator.in_force = Configuration(configuration().site, configuration().modules, {}, "d" * 64)
    one.ends(2)
    seen = [record["configuration"][0] for record in one.records("decision")]
    times = [record["time"] for record in one.records("decision")]
    assert list(zip(seen, times, strict=True))[:4] == [("c", 0.0), ("c", 0.0), ("d", 3.0), ("d", 3.0)]
    (changed,) = one.records("configuration-changed")
    assert changed["configuration"] == "d" * 64


def test_a_stop_by_the_operator_ends_everything(cart: MakeCart) -> None:
    operator = Operator()
    one = cart(governor=operator, reach=asking(move()), drive=asking(roll()))
    one.start("reach")
    one.start("drive")
    assert one.executor.wait(0.05) is None
    operator.command = OperatorCommand.STOP
    assert one.executor.is_stopped
    ended = one.ends(2).values()
    assert {(one.status, one.reason) for one in ended} == {(StepStatus.HALTED, "stopped by the operator")}
    one.assert_nothing_is_held()


def test_a_refused_request_is_recorded_with_what_was_asked(make_bench: MakeBench) -> None:
    bench = make_bench(twice)
    assert bench.submit(StepRequest("absent", "lift", {"height": 0.05})).status is StepStatus.REFUSED
    (refused,) = bench.records("step-refused")
    asked = {"module": "absent", "skill": "lift", "inputs": {"height": 0.05}}
    assert refused["details"] == {"reason": "no module `absent` is active", **asked}
    assert bench.plant.calls == []


def test_a_caller_may_let_time_advance_bit_by_bit(cart: MakeCart) -> None:
    one = cart(reach=asking(move()))
    reach = one.start("reach")
    # The skill asks for its motion, the motion goes on to 0.05 s and to its end at 0.1 s, the skill ends.
    found = [one.executor.advance_once(until) for until in (inf, 0.05, inf, inf)]
    assert found == [None, None, None, EndedStep(reach, StepResult(StepStatus.FINISHED, "", allowed=1))]
    assert one.plant.time == 0.1


def test_an_ended_step_is_fetched_before_time_advances(cart: MakeCart) -> None:
    one = cart(reach=asking(move()))
    steps = [one.start("reach"), one.start("reach")]
    for step in steps:
        one.executor.cancel(step, "not wanted")
    cancelled = StepResult(StepStatus.CANCELLED, "not wanted")
    assert one.executor.advance_once(inf) == EndedStep(steps[0], cancelled)
    assert one.executor.wait() == EndedStep(steps[1], cancelled)
    assert one.plant.calls == []


def test_decisions_are_counted_while_a_step_is_active(cart: MakeCart) -> None:
    one = cart(reach=asking(move(), move()))
    reach = one.start("reach")
    assert one.executor.decision_counts(reach) == DecisionCounts()
    assert one.executor.wait(0.15) is None
    assert one.executor.decision_counts(reach) == DecisionCounts(allowed=2)
    one.ends(1)
    assert one.executor.decision_counts(reach) is None


def test_a_closed_executor_leaves_no_step_and_is_closed_once(cart: MakeCart) -> None:
    ends: list[str] = []
    one = cart(reach=asking(move(), ends=ends, name="reach"))
    with one.executor:
        one.start("reach")
        assert one.executor.wait(0.05) is None
    one.executor.close()
    assert ends == ["reach"]
    assert one.plant.call_count("stop") == 1
    (broken,) = one.records("step-broken")
    assert broken["reason"] == "MisuseError: the executor was closed before the step ended"


def test_a_certificate_is_that_of_the_module_in_force(cart: MakeCart) -> None:
    assert cart().executor.certificate("cart") is None
    assert cart().executor.certificate("absent") is None


def test_certificates_are_those_of_the_configuration(cart: MakeCart) -> None:
    certificate: Any = SimpleNamespace(module="cart", manifest="another", site="another")
    under = replace(configuration(), certificates={"cart": certificate})
    one = cart(under=under, reach=asking(move()))
    assert one.executor.certificate("cart") is certificate
    assert one.executor.certificate("other") is None


def test_an_action_has_the_names_of_the_site_for_what_its_module_needs(cart: MakeCart) -> None:
    module = configuration().modules["cart"]
    names = replace(module.names, kinds={"go": "move"})
    under = replace(configuration(), modules={"cart": replace(module, names=names)})
    one = cart(under=under, reach=asking(act("go", speed=0.25), move()))
    assert one.executor.run_step(StepRequest("cart", "reach", {})).status is StepStatus.FINISHED
    assert one.plant.executed == [move(), move()]
    unknown = cart(under=under, reach=asking(act("fly", speed=0.25)))
    assert unknown.executor.run_step(StepRequest("cart", "reach", {})).status is StepStatus.DENIED


def test_a_stop_without_a_word_is_recorded_without_a_reason(cart: MakeCart) -> None:
    one = cart(reach=asking(move()))
    one.plant.script([MotionCompletion(False)])
    assert one.executor.run_step(StepRequest("cart", "reach", {})).reason == "the plant gave no reason"
    assert [(stop["reason"], stop["ticks"]) for stop in one.records("stopped")] == [("", 1)]


def test_decisions_are_counted_by_kind_until_the_step_ends(
    make_bench: MakeBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = make_bench(twice)
    slower = Decision(DecisionKind.ATTENUATE, act("move"), (Reason("AE750", "speed", "too fast"),))
    obstruction = Decision(DecisionKind.DENY, None, (Reason("AE766", "box", "in the way"),))
    monkeypatch.setattr(bench.executor._pipeline, "find_detour", lambda *_: [act("move"), act("move")])
    bench.gate.answers = [slower, obstruction, DENIAL]
    step = bench.executor.start(STEP)
    assert not isinstance(step, StepResult)
    counts = [bench.executor.decision_counts(step)]
    while bench.executor.advance_once(inf) is None:
        counts.append(bench.executor.decision_counts(step))
    assert counts[0] == DecisionCounts()
    assert counts[-1] == DecisionCounts(attenuated=1, denied=2)
    assert bench.executor.decision_counts(step) is None


@pytest.mark.parametrize("is_answering", [False, True])
def test_a_step_whose_module_was_changed_ends_before_it_acts(cart: MakeCart, is_answering: bool) -> None:
    operator = Operator()
    module = replace(configuration().modules["cart"], code_digest="e" * 64)
    changed = Configuration(configuration().site, {"cart": module}, {}, "d" * 64)

    def change() -> None:
        operator.generation, operator.in_force = operator.generation + 1, changed

    def body(observed: Observation, inputs: Inputs) -> SkillBody:
        if is_answering:
            change()
        yield move()

    one = cart(governor=operator, reach=body)
    one.start("reach")
    if not is_answering:
        change()
    (result,) = one.ends(1).values()
    assert result.status is StepStatus.STOPPED
    assert result.reason == "revoked: `cart` is no longer active, or was changed"
    assert one.plant.executed == []


def test_a_step_that_waits_for_a_resource_that_is_gone_ends(cart: MakeCart) -> None:
    one = cart(reach=asking(move()))
    first, second = one.start("reach"), one.start("reach")
    assert one.executor.wait(0.0) is None
    assert one.plant.calls == [], "it is that time already"
    one.executor.advance_once(0.0)
    one.executor._resources.set_capacities({"arm": 1, "camera": 0, "actuator arm": 1})
    ends = [ended for _ in range(6) if (ended := one.executor.advance_once(inf)) is not None]
    results = {ended.step: ended.result for ended in ends}
    assert results[first].status is StepStatus.FINISHED
    assert results[second] == StepResult(StepStatus.STOPPED, "this site no longer has `camera`")


@pytest.mark.parametrize("reason", ["the plant: monitor:separation", "monitor:", "blocked"])
def test_only_the_name_of_a_rule_is_explained(cart: MakeCart, reason: str) -> None:
    one = cart(reach=asking(move()))
    one.plant.script([MotionCompletion(False, reason)])
    result = one.executor.run_step(StepRequest("cart", "reach", {}))
    assert (result.status, result.reason, result.causes) == (StepStatus.STOPPED, reason, ())


class _Perceiving:
    """Perceivers that note how they are steered."""

    def __init__(self) -> None:
        self.steered: list[Any] = []

    def attend(self, modules: frozenset[str] | None) -> None:
        self.steered.append(modules)

    def set_parameters(self, values: Any) -> None:
        self.steered.append(values)

    def set_memories(self, memories: Any) -> None:
        self.steered.append(memories)

    def close_perceivers(self) -> None:
        self.steered.append("closed")


@pytest.mark.parametrize("perception", [None, _Perceiving()])
def test_perceivers_are_steered_by_the_agent_and_closed_at_the_end(
    make_bench: MakeBench, perception: _Perceiving | None
) -> None:
    bench = make_bench(twice)
    gate = CompiledGate(configuration(), GateMode.COMPILED)
    one = Executor(configuration(), gate, bench.plant, bench.audit, run_in_process, perception=perception)
    one.attend(frozenset({"kettle"}))
    one.attend(None)
    one.set_parameters({"rate": 2.0})
    one.set_memories({"kettle": {"hot": True}})
    one.close()
    if perception is not None:
        assert perception.steered == [
            {"kettle"},
            None,
            {"rate": 2.0},
            {"kettle": {"hot": True}},
            "closed",
        ]


def test_a_change_while_the_skill_computes_is_in_force_for_its_action(cart: MakeCart) -> None:
    class Changing(Operator):
        def hold_generation(self, generation: int) -> AbstractContextManager[bool]:
            if self.generation == 0:
                self.generation, self.in_force = 1, replace(configuration(), digest="d" * 64)
            return super().hold_generation(generation)

    one = cart(governor=Changing(), reach=asking(move()))
    one.start("reach")
    assert [result.status for result in one.ends(1).values()] == [StepStatus.FINISHED]
    assert [record["configuration"] for record in one.records("decision")] == ["d" * 64]


def test_a_skill_senses_what_the_site_in_force_has(cart: MakeCart) -> None:
    operator, seen = Operator(), list[Observation]()

    def looking(observed: Observation, inputs: Inputs) -> SkillBody:
        seen.append(observed)
        site = configuration().site
        state = {**site.state, "moved": replace(site.state["moved"], sensor="scanner")}
        other = replace(site, state=state, digest="6" * 64)
        operator.generation, operator.in_force = 1, replace(configuration(), site=other, digest="d" * 64)
        seen.append((yield move()))

    one = cart(governor=operator, reach=looking)
    one.start("reach")
    assert [result.reason for result in one.ends(1).values()] == [""]
    assert [sorted(observed) for observed in seen] == [
        ["charge", "done", "hand", "moved", "stop_pressed"],
        ["charge", "done", "hand", "stop_pressed"],
    ]


def test_a_denial_that_may_pass_names_the_values_that_broke_it(cart: MakeCart) -> None:
    one = cart(reach=asking(move()))
    one.plant.values = {**one.plant.values, "stop_pressed": True}
    result = one.executor.run_step(StepRequest("cart", "reach", {}))
    assert (result.status, result.is_transient) == (StepStatus.DENIED, True)
    assert result.reason == "AE750 stop-button: stop_pressed is true"


def test_a_rule_without_values_is_named_alone_and_several_values_are_listed(cart: MakeCart) -> None:
    one = cart(reach=asking(move()), drive=asking(roll()))
    one.plant.script([MotionCompletion(False, "monitor:unheard-of")])
    result = one.executor.run_step(StepRequest("cart", "reach", {}))
    assert (result.reason, result.causes) == (
        "monitor:unheard-of",
        (Cause("stopped", "unheard-of", "unheard-of"),),
    )
    one.start("reach")
    one.start("drive")
    one.plant.during = [{"hand": 1.5}]
    expected = "abs(hand) is 1.5 m (at most 1 m), moving.speed is 0.25 m/s (at most 0.1 m/s)"
    assert {result.reason for result in one.ends(2).values()} == {
        f"monitor:hand-near-while-rolling: {expected}"
    }
