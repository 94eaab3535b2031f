"""Several steps under way: who acts when, and what an end leaves alone."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from math import inf, nan
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from aeros.runtime.audit.log import AuditError
from aeros.runtime.execution import scheduler as module
from aeros.runtime.execution.governor import OperatorCommand
from aeros.runtime.gate.decision import Decision, DecisionKind, Reason
from aeros.runtime.monitor.late_ticks import LateTickCounter
from aeros.runtime.monitor.monitor import RuntimeMonitor
from aeros.runtime.ports import (
    EndedStep,
    MotionCompletion,
    NoMotion,
    ObservedMonitor,
    StepHandle,
    StepRequest,
    StepResult,
    StepStatus,
    announce_stop,
)
from aeros.runtime.skills.in_process_run import InProcessRun, SkillRunResult
from aeros.sim.fake import FakePlant
from aeros.skill import Action, ActionDenied, Inputs, Observation, SkillBody, act
from aeros.spec.diagnostics.errors import InternalError, MisuseError
from aeros.spec.model.motion import LateTicks
from tests.unit.runtime.one_step import DENIAL, STEP, MakeBench, watched
from tests.unit.runtime.perception import kettle
from tests.unit.runtime.together import VALUES, Cart, MakeCart, Operator, asking, configuration, move, roll

FINISHED = StepStatus.FINISHED
LATE = LateTicks(Fraction(5, 1000), 2, Fraction(20, 1000))


# Who acts when.


def test_two_skills_act_in_turn_as_their_motions_end(cart: MakeCart) -> None:
    one = cart(reach=asking(move(), move(), move()), drive=asking(roll(), roll()))
    one.plant.durations = [1.0, 1.75, 1.0, 1.75, 1.0]
    reach, drive = one.start("reach"), one.start("drive")
    assert one.executor.wait() == EndedStep(reach, StepResult(FINISHED, "", allowed=3))
    assert one.plant.time == 3.0
    assert one.executor.wait() == EndedStep(drive, StepResult(FINISHED, "", allowed=2))
    assert one.started_kinds() == ["move", "roll", "move", "roll", "move"]
    assert one.plant.call_count("stop") == 0
    assert one.calls("skill_ended") == [("cart.reach", True), ("cart.drive", True)]


def test_the_motions_of_others_go_on_between_the_denials_of_a_skill(cart: MakeCart) -> None:
    def stubborn(observed: Observation, inputs: Inputs) -> SkillBody:
        for _ in range(5):
            with suppress(ActionDenied):
                yield move(1000.0)

    one = cart(drive=asking(roll()), reach=stubborn)
    one.plant.durations = [0.5]
    one.start("drive")
    one.start("reach")
    assert {result.denied for result in one.ends(2).values()} == {0, 5}
    times = [record["time"] for record in one.records("decision") if record["verdict"] == "DENY"]
    assert times == pytest.approx([0.0, 0.02, 0.04, 0.06, 0.08])


def test_a_decision_names_the_decisions_on_what_was_under_way(cart: MakeCart) -> None:
    one = cart(reach=asking(move()), drive=asking(roll()), look=asking(act("wait", duration=1.0)))
    for skill in ("reach", "drive"):
        one.start(skill)
    one.ends(2)
    first, second = one.records("decision")
    assert "beside" not in first
    assert second["beside"] == [first["sequence"]]


def test_a_step_that_needs_a_held_resource_waits_its_turn(cart: MakeCart) -> None:
    one = cart(reach=asking(move()), drive=asking(roll()))
    first, second, third = one.start("reach"), one.start("reach"), one.start("drive")
    assert [one.executor.wait(), one.executor.wait(), one.executor.wait()] == [
        EndedStep(step, StepResult(FINISHED, "", allowed=1)) for step in (first, second, third)
    ]
    # The third would have had all it needs at once, and one thing that the second waited for.
    assert one.calls("skill_began") == ["cart.reach", "cart.reach", "cart.drive"]
    one.assert_nothing_is_held()


def test_a_time_out_runs_from_when_a_step_begins_and_not_from_when_it_was_asked_for(cart: MakeCart) -> None:
    one = cart(reach=asking(move()))
    one.plant.duration = 8.0
    one.start("reach")
    one.start("reach")
    assert [result.status for result in one.ends(2).values()] == [FINISHED, FINISHED]


# What happens while both are under way.


def test_a_joint_rule_that_breaks_at_a_tick_stops_both(cart: MakeCart) -> None:
    ends: list[str] = []
    one = cart(
        reach=asking(move(), ends=ends, name="reach"),
        drive=asking(roll(), ends=ends, name="drive"),
        look=asking(act("wait", duration=1.0)),
    )
    reach, drive = one.start("reach"), one.start("drive")
    one.plant.during = [{"charge": 0.3}, {"charge": 0.1}]
    message = "monitor:charge-for-both: charge is 0.1 (at least 0.2)"
    expected = StepResult(StepStatus.STOPPED, message, allowed=1)
    ended = one.ends(2)
    assert {who: replace(result, causes=()) for who, result in ended.items()} == {
        reach: expected,
        drive: expected,
    }
    assert [str(cause) for cause in ended[reach].causes] == ["charge-for-both: charge is 0.1 (at least 0.2)"]
    assert ends == ["reach", "drive"]
    assert one.calls("skill_ended") == [("cart.reach", False), ("cart.drive", False)]
    one.assert_nothing_is_held()
    one.plant.during = [{"charge": 0.1}]
    assert one.executor.run_step(StepRequest("cart", "reach", {})).status is FINISHED


@pytest.mark.parametrize("measured", [{"charge": nan}, {"charge": "full"}, {"unheard_of": 1.0}])
def test_an_unreadable_value_at_a_tick_is_a_violation_too(cart: MakeCart, measured: dict[str, Any]) -> None:
    one = cart(reach=asking(move()), drive=asking(roll()))
    one.start("reach")
    one.start("drive")
    one.plant.during = [measured]
    (name,) = measured
    reason = f"monitor:input:{name}: `{name}` is missing, old or malformed"
    assert {result.reason for result in one.ends(2).values()} == {reason}


def test_one_that_is_late_is_halted_and_the_other_goes_on(cart: MakeCart) -> None:
    one = cart(reach=asking(move()), drive=asking(roll(), roll()))
    one.plant.durations = [20.0, 6.0, 6.0]
    reach, drive = one.start("reach"), one.start("drive")
    results = one.ends(2)
    assert results[reach] == StepResult(
        StepStatus.TIMED_OUT, "the skill's timeout passed during a motion", allowed=1
    )
    assert results[drive].status is StepStatus.TIMED_OUT  # at 10 s, amid its second
    assert one.plant.time == 10.0


def test_a_denied_step_leaves_what_the_other_moves_alone(cart: MakeCart) -> None:
    one = cart(reach=asking(move(), move(5.0)), drive=asking(roll()))
    one.plant.durations = [0.5, 5.0]
    reach, drive = one.start("reach"), one.start("drive")
    results = one.ends(2)
    assert (results[reach].status, results[drive].status) == (StepStatus.DENIED, FINISHED)
    assert one.plant.call_count("stop") == 0
    assert one.plant.call_count("halt") == 0


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


@pytest.mark.parametrize(("at", "status"), [(10.0, FINISHED), (10.5, StepStatus.TIMED_OUT)])
def test_a_skill_that_finishes_late_has_timed_out(
    make_bench: MakeBench, at: float, status: StepStatus
) -> None:
    def late(observed: Observation, inputs: Inputs) -> SkillBody:
        yield act("move")
        bench.plant.time = at

    bench = make_bench(late)
    assert bench.submit().status is status
    bench.assert_cleaned_up(finished=status is FINISHED)


def test_a_motion_that_outlasts_the_time_out_is_halted_within_a_few_turns(make_bench: MakeBench) -> None:
    bench = make_bench(watched([]))
    bench.plant.duration = 20.0
    assert not isinstance(bench.executor.start(STEP), StepResult)
    ends = [ended.result.status for _ in range(4) if (ended := bench.executor.advance_once(inf)) is not None]
    assert (ends, bench.plant.time) == ([StepStatus.TIMED_OUT], 10.0)


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
        (_raises(GeneratorExit()), "GeneratorExit"),
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
    assert re.match(rf"(test_scheduler\.py:\d+: )?{re.escape(reason)}", result.reason)
    bench.assert_cleaned_up(finished=False)
    assert bench.records("step-ended")[0]["details"]["status"] == "raised"


def test_code_that_does_not_take_its_arguments_is_halted(make_bench: MakeBench) -> None:
    bench = make_bench(lambda: None)
    assert bench.submit().status is StepStatus.RAISED
    bench.assert_cleaned_up(finished=False)


def test_a_skill_that_floods_is_halted(make_bench: MakeBench) -> None:
    ends: list[str] = []
    bench = make_bench(watched(ends))
    bench.plant.duration = 0.0
    bench.executor.start(STEP)
    turns = (bench.executor.advance_once(inf) for _ in range(602))
    (result,) = [ended.result for ended in turns if ended is not None]
    assert (result.status, result.allowed, ends) == (StepStatus.RAISED, 300, ["closed"])
    assert result.reason == "the skill asked for more than 300 actions, the most in its timeout of 10 s"
    bench.assert_cleaned_up(finished=False)


def test_a_skill_that_is_slow_each_time_is_halted_in_real_time(
    make_bench: MakeBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The plant's clock stands still meanwhile, as that of a simulator does."""
    clock = [100.0]
    monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=lambda: clock[0], sleep=time.sleep))

    def slow(observed: Observation, inputs: Inputs) -> SkillBody:
        while True:
            clock[0] += 2.5
            yield act("move")

    bench = make_bench(slow)
    bench.plant.duration = 0.0
    result = bench.submit()
    assert (result.status, result.allowed) == (StepStatus.TIMED_OUT, 4)
    assert result.reason == "the skill took 12.5 s of real time for its answers; it has 10 s"
    bench.assert_cleaned_up(finished=False)


def test_an_answer_may_take_no_longer_than_what_is_left_for_all(
    cart: MakeCart, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock, offered = [0.0], list[float]()
    monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=lambda: clock[0], sleep=time.sleep))
    one = cart(reach=asking(move(), move()))
    resume = InProcessRun.resume

    def timed(
        run: InProcessRun, observation: Observation, seconds: float, denial: str
    ) -> Action | SkillRunResult:
        offered.append(seconds)
        clock[0] += 4.0
        return resume(run, observation, seconds, denial)

    monkeypatch.setattr(InProcessRun, "resume", timed)
    one.plant.durations = [7.0, 0.5]
    one.start("reach")
    assert [ended.status for ended in one.ends(1).values()] == [StepStatus.TIMED_OUT]
    assert offered == [10.0, 3.0, 2.0]


def test_strange_parameters_are_recorded_and_denied(make_bench: MakeBench) -> None:
    bench = make_bench(_yields(act("move", speed=nan, more=[object()], huge="x" * 2_000_000)))
    bench.gate.answers = [Decision(DecisionKind.ALLOW, act("move"), ()), DENIAL]
    assert bench.submit().status is StepStatus.DENIED
    details = bench.records("decision")[-1]["details"]
    assert details["verdict"] == "DENY"
    assert details["asked"]["parameters"]["speed"] == {"float": "nan"}
    assert details["asked"]["parameters"]["huge"] == {"unencodable": "too large"}


def test_a_revoked_step_is_halted_and_the_other_continues(cart: MakeCart) -> None:
    asked = set()

    class Blocking(Operator):
        def revocation_reason(self, module: str, skill: str, kind: str) -> str | None:
            asked.add((module, skill, kind))
            return super().revocation_reason(module, skill, kind)

    operator = Blocking()
    one = cart(governor=operator, reach=asking(move()), drive=asking(roll(), roll()))
    reach, drive = one.start("reach"), one.start("drive")
    assert one.executor.wait(0.05) is None
    operator.generation, operator.revoked = 1, {"reach"}
    results = one.ends(2)
    assert asked == {("cart", "reach", "move"), ("cart", "drive", "roll")}
    assert results[reach] == StepResult(StepStatus.STOPPED, "revoked: the test says so", allowed=1)
    assert results[drive].status is StepStatus.FINISHED
    one.assert_nothing_is_held()


def test_while_the_operator_pauses_what_moves_ends_and_nothing_begins(cart: MakeCart) -> None:
    operator = Operator()
    one = cart(governor=operator, reach=asking(move(), move()), drive=asking(roll(), roll()))
    one.plant.durations = [1.0, 3.0]
    one.start("reach")
    one.start("drive")
    assert one.executor.wait(0.5) is None
    operator.command = OperatorCommand.PAUSE
    assert one.executor.wait(3.0) is None
    assert one.started_kinds() == ["move", "roll"]
    operator.command = OperatorCommand.RUN
    assert {result.status for result in one.ends(2).values()} == {StepStatus.FINISHED}
    assert [len(one.records(event)) for event in ("paused", "resumed")] == [1, 1]


def test_while_nothing_moves_a_pause_is_polled_and_recorded(
    cart: MakeCart, monkeypatch: pytest.MonkeyPatch
) -> None:
    operator, naps = Operator(), list[float]()
    monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=time.monotonic, sleep=naps.append))
    one = cart(governor=operator, reach=asking(move()))
    one.start("reach")
    operator.command, one.plant.time = OperatorCommand.PAUSE, 1.5
    assert [one.executor.advance_once(inf) for _ in range(3)] == [None, None, None]
    assert (naps, one.plant.calls) == ([0.01] * 3, [("skill_began", "cart.reach")])
    operator.command, one.plant.time = OperatorCommand.RUN, 2.5
    ends = [ended.result.status for _ in range(4) if (ended := one.executor.advance_once(inf)) is not None]
    assert (ends, len(naps)) == ([FINISHED], 3)
    for event, at in (("paused", 1.5), ("resumed", 2.5)):
        assert [{**record, "sequence": 0} for record in one.records(event)] == [{"time": at, "sequence": 0}]


def _raises_while_moving(failure: BaseException) -> Callable[[Cart, Operator], None]:
    def cause(one: Cart, operator: Operator) -> None:
        one.plant.failing["advance"] = failure
        with pytest.raises(type(failure)):
            one.executor.wait()

    return cause


def _ends(one: Cart, operator: Operator) -> None:
    one.ends(1)


def _blocked(one: Cart, operator: Operator) -> None:
    one.plant.completions = [MotionCompletion(False, "blocked: something is in the way")]
    one.ends(1)


def _announced(one: Cart, operator: Operator) -> None:
    class Blocked(type(one.plant)):  # type: ignore[misc]
        def advance(self, monitor: Any, until: float) -> Any:
            self.completions = [MotionCompletion(False, "blocked: something is in the way")]
            announce_stop(
                ObservedMonitor(monitor, lambda *_: None), "blocked: something is in the way", self.time
            )
            self.during = [{"hand": 0.75}]
            return super().advance(monitor, until)

    one.plant.__class__ = Blocked
    one.ends(1)


def _breaks_a_rule(one: Cart, operator: Operator) -> None:
    one.plant.values = {**one.plant.values, "stop_pressed": True}
    one.ends(1)


def _revoked(one: Cart, operator: Operator) -> None:
    operator.generation, operator.revoked = 1, {"reach"}
    one.ends(1)


def _stopped(one: Cart, operator: Operator) -> None:
    operator.command = OperatorCommand.STOP
    one.ends(1)


def _cancelled(one: Cart, operator: Operator) -> None:
    one.executor.cancel(StepHandle(1), "not wanted")
    one.ends(1)


def _late(one: Cart, operator: Operator) -> None:
    one.plant._ends = dict.fromkeys(one.plant._ends, 1e6)
    one.ends(1)


def _asked_for(one: Cart, operator: Operator) -> None:
    one.executor.run_step(StepRequest("cart", "look", {}))
    one.ends(1)


def _closed(one: Cart, operator: Operator) -> None:
    one.executor.close()


CAUSES: dict[str, tuple[Callable[[Cart, Operator], None], str]] = {
    "a rule": (_breaks_a_rule, "stop-button"),
    "the plant, which says so": (_announced, "blocked: something"),
    "the plant, without a word": (_blocked, "blocked: something"),
    "the operator's stop": (_stopped, "stopped by the operator"),
    "the operator's block": (_revoked, "revoked: the test says so"),
    "the caller": (_cancelled, "not wanted"),
    "the skill's timeout": (_late, "the skill's timeout passed"),
    "a protective stop": (_asked_for, "stopped for `cart.look`"),
    "a plant that fails": (_raises_while_moving(OSError("link lost")), "link lost"),
    "an interrupt": (_raises_while_moving(KeyboardInterrupt()), "KeyboardInterrupt"),
    "the end of the session": (_closed, "closed before the step ended"),
}


@pytest.mark.parametrize("name", CAUSES)
def test_every_cause_that_cuts_a_motion_short_leaves_one_record_of_the_stop(
    cart: MakeCart, name: str
) -> None:
    cause, reason = CAUSES[name]
    operator = Operator()
    one = cart(governor=operator, reach=asking(move()), look=asking(act("stop")))
    assert one.start("reach") == 1
    assert one.executor.wait(0.05) is None
    cause(one, operator)
    (stop,) = one.records("stopped")
    assert stop["reason"].startswith(reason) or reason in stop["reason"], stop["reason"]
    assert stop["ticks"] >= 1
    assert stop["time"] >= stop["began"] >= 0.0
    assert stop["quantities"]["hand"] == {
        "least": 0.0,
        "greatest": 0.75 if "says" in name else 0.0,
        "unit": "m",
    }


class _RealTime(FakePlant):
    """A plant that does not wait, whose every tick comes after a time in ms."""

    runs_in_real_time = True
    gaps: tuple[float, ...] = ()
    clock = 0.0

    def advance(self, monitor: Any, until: float) -> Any:
        def late(now: float, values: Any) -> Any:
            gap, *rest = self.gaps or (0.0,)
            self.gaps, self.clock = tuple(rest), self.clock + gap / 1000.0
            return monitor(now, values)

        return super().advance(late, until)


@pytest.mark.parametrize(
    ("gaps", "status", "count"),
    [((1, 1, 1, 1), StepStatus.FINISHED, 0), ((1, 9, 1), FINISHED, 1), ((1, 30, 1), StepStatus.STOPPED, 1)],
)
def test_late_ticks_of_a_plant_in_real_time_are_counted_and_stop_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, gaps: tuple[float, ...], status: StepStatus, count: int
) -> None:
    plant = _RealTime(VALUES)
    plant.gaps, plant.during = gaps, [{}] * len(gaps)
    monkeypatch.setattr("aeros.runtime.monitor.late_ticks.time.monotonic", lambda: plant.clock)
    monkeypatch.setattr(module, "_late_tick_counter", lambda plant, site: LateTickCounter(LATE))
    one = Cart(tmp_path / "log", {"reach": asking(move())}, plant=plant)
    one.start("reach")
    (result,) = one.ends(1).values()
    assert result.status is status
    (ended,) = one.records("step-ended")
    assert ended.get("late_ticks", 0) == count
    stops = [(stop["reason"], stop["late_ticks"], stop["began"]) for stop in one.records("stopped")]
    assert stops == ([("late-ticks", count, 0.0)] if status is StepStatus.STOPPED else [])


@pytest.mark.parametrize("is_moving", [True, False])
def test_time_between_ticks_counts_while_anything_moves(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, is_moving: bool
) -> None:
    """A skill that computes for a second is late if another's motion goes on meanwhile."""
    plant = _RealTime(VALUES)
    monkeypatch.setattr("aeros.runtime.monitor.late_ticks.time.monotonic", lambda: plant.clock)
    site = replace(configuration().site, motion=cast("Any", SimpleNamespace(late_ticks=LATE)))
    monkeypatch.setattr(
        module, "_late_tick_counter", lambda plant, _, make=module._late_tick_counter: make(plant, site)
    )

    def slow(observed: Observation, inputs: Inputs) -> SkillBody:
        yield roll()
        plant.clock += 1.0
        yield roll()

    one = Cart(tmp_path / "log", {"reach": asking(move()), "drive": slow}, plant=plant)
    plant.gaps = (30.0,)
    assert one.executor.wait(2.5) is None
    assert (plant.time, one.records("stopped")) == (2.5, []), "nothing moves, so no tick is late"
    plant.durations = [1.0, 0.5, 0.5] if is_moving else []
    if is_moving:
        one.start("reach")
    one.start("drive")
    statuses = {result.status for result in one.ends(1 + is_moving).values()}
    assert statuses == {StepStatus.STOPPED if is_moving else FINISHED}


def test_a_plant_in_real_time_needs_a_site_that_bounds_late_ticks(tmp_path: Path) -> None:
    expected = (
        "the plant runs in real time, and the site `cart` does not bound late ticks: add `motion.late_ticks`"
    )
    with pytest.raises(MisuseError) as caught:
        Cart(tmp_path / "log", {}, plant=_RealTime(VALUES))
    assert str(caught.value) == expected
    site = replace(configuration().site, motion=cast("Any", SimpleNamespace(late_ticks=None)))
    with pytest.raises(MisuseError) as caught:
        module._late_tick_counter(_RealTime(VALUES), site)
    assert str(caught.value) == expected
    assert module._late_tick_counter(FakePlant(VALUES), site) is None


def test_an_operators_stop_is_measured_from_its_first_tick(cart: MakeCart) -> None:
    operator = Operator()
    one = cart(governor=operator, reach=asking(move()))
    one.start("reach")
    assert one.executor.wait(0.05) is None
    operator.command, one.plant.during = OperatorCommand.STOP, [{"hand": 0.75}]
    one.ends(1)
    (stop,) = one.records("stopped")
    assert (stop["began"], stop["ticks"], stop["quantities"]["hand"]["greatest"]) == (0.05, 1, 0.75)


def test_a_tick_during_a_stop_is_monitored_at_its_time(
    cart: MakeCart, monkeypatch: pytest.MonkeyPatch
) -> None:
    one, ticks = cart(reach=asking(move())), list[Any]()
    one.start("reach")
    assert one.executor.wait(0.05) is None
    monkeypatch.setattr(RuntimeMonitor, "__call__", lambda monitor, *tick: ticks.append(tick))
    monitor = one.executor._scheduler.tick_monitor
    monitor.begin_stop("blocked", 0.05)
    monitor(0.06, one.plant.values)
    assert ticks == [(0.06, one.plant.values)]


def test_the_motion_that_was_decided_is_begun_and_watched(
    make_bench: MakeBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench, plan, watched_plans = make_bench(asking_twice), NoMotion("none"), list[Any]()
    decide, add = bench.executor._pipeline.decide, RuntimeMonitor.add
    monkeypatch.setattr(bench.executor._pipeline, "decide", lambda *asked: decide(*asked)._replace(plan=plan))

    def adding(monitor: RuntimeMonitor, action: Any, plan: object = None) -> None:
        watched_plans.append(plan)
        add(monitor, action, plan)

    monkeypatch.setattr(RuntimeMonitor, "add", adding)
    assert bench.submit().status is FINISHED
    assert watched_plans == bench.plant.decided == [plan, plan]


def test_names_of_cameras_are_those_of_the_site(cart: MakeCart) -> None:
    one = cart(under=kettle.configuration(kettle.kettle()))
    ecm = kettle.kettle()
    ecm = replace(ecm, names=replace(ecm.names, cameras={"eye": "overhead"}))
    named = one.executor._scheduler._control._with_site_names(ecm, act("look", camera="eye", other="eye"))
    assert named == act("look", camera="overhead", other="eye")
    assert one.executor._scheduler._control._with_site_names(kettle.kettle(), named) == named


# Ways round obstacles.

OBSTRUCTION = Decision(DecisionKind.DENY, None, (Reason("AE766", "box", "in the way"),))


def test_the_legs_round_an_obstacle_come_before_what_the_skill_asks_next(
    make_bench: MakeBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    one = make_bench(asking_twice)
    one.gate.answers = [OBSTRUCTION]
    leg, found = act("move", speed=0.05), []

    def find(caller: Any, denied: Decision, action: Action) -> list[Action]:
        found.append((caller, denied, action))
        return [leg, action]

    monkeypatch.setattr(one.executor._pipeline, "find_detour", find)
    result = one.submit()
    assert (result.status, result.allowed, result.denied) == (FINISHED, 3, 1)
    assert [action.parameters["speed"] for action in one.plant.executed] == [0.05, 0.1, 0.2]
    (asked, *_) = one.gate.asked
    assert found == [(asked[0], OBSTRUCTION, act("move", speed=0.1))]


def test_a_leg_that_is_denied_ends_the_step(make_bench: MakeBench, monkeypatch: pytest.MonkeyPatch) -> None:
    one = make_bench(asking_twice)
    one.gate.answers = [OBSTRUCTION, DENIAL]
    monkeypatch.setattr(
        one.executor._pipeline,
        "find_detour",
        lambda caller, denied, action: [act("move", speed=0.05), action],
    )
    result = one.submit()
    assert (result.status, result.denied) == (StepStatus.DENIED, 2)
    assert one.plant.executed == []


def test_without_a_way_round_the_step_is_denied_and_the_obstacle_named(make_bench: MakeBench) -> None:
    one = make_bench(asking_twice)
    one.gate.answers = [OBSTRUCTION]
    result = one.submit()
    assert result.status is StepStatus.DENIED
    assert result.reason == "AE766 box: in the way; no way round was found"
    assert not result.is_transient


def asking_twice(observed: Observation, inputs: Inputs) -> SkillBody:
    yield act("move", speed=0.1)
    yield act("move", speed=0.2)
