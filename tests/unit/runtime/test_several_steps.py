"""Several steps under way: who acts when, what is decided together, and what an end leaves alone."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from fractions import Fraction
from math import nan
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.audit import verify_log
from aeros.runtime.audit_check import Record
from aeros.runtime.beside import Begun
from aeros.runtime.configuration import Configuration
from aeros.runtime.decision import Decision, Verdict
from aeros.runtime.gate import Gate, GateMode
from aeros.runtime.governor import Command, Governor
from aeros.runtime.ports import (
    Ball,
    Body,
    Ended,
    Motionless,
    Reading,
    StepRequest,
    StepResult,
    StepStatus,
    Trajectory,
)
from aeros.runtime.replay import Replay
from aeros.skill import Inputs, Observation, SkillBody, act
from aeros.spec.errors import InternalError, MisuseError
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import EnumType, FamilyType, RealType
from aeros.spec.model import MotionKind, MotionPolicy, ToolLimits
from aeros.spec.units import ANGLE
from tests.unit.runtime.conftest import declare
from tests.unit.runtime.together import Asking, Cart, asking, configuration, move, roll

MakeCart = Callable[..., Cart]
FINISHED = StepStatus.FINISHED


@pytest.fixture
def cart(tmp_path: Path) -> Iterator[MakeCart]:
    made: list[Cart] = []

    def make(mode: GateMode = GateMode.COMPILED, governor: Governor | None = None, **bodies: Asking) -> Cart:
        made.append(Cart(tmp_path / f"audit-{len(made)}.jsonl", bodies, mode, governor))
        return made[-1]

    yield make
    for one in made:
        one.audit.close()


def replayed(
    log: Path,
    mode: GateMode = GateMode.COMPILED,
    change: Callable[[Record], Record | None] = lambda record: record,
) -> Replay:
    """The decisions of a log decided again, each as `change` makes it."""
    replay = Replay(configuration(), Gate(configuration(), mode))

    def take(record: Record, own: str) -> None:
        changed = change(record)
        if changed is not None:
            replay.take(changed)

    assert verify_log(log, take).sound
    return replay


def _alone(details: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in details.items() if name != "beside"}


class Operator:
    """A governor in the test's hands."""

    def __init__(self) -> None:
        self.generation = 0
        self.command = Command.RUN
        self.revoked: set[str] = set()
        self.in_force = configuration()
        self.held = 0

    def configuration(self) -> tuple[int, Configuration]:
        return self.generation, self.in_force

    def acting(self, generation: int) -> AbstractContextManager[bool]:
        return nullcontext(generation == self.generation)

    def objection(self, module: str, skill: str, kind: str) -> str | None:
        return "the test says so" if skill in self.revoked else None


# Who acts when.


def test_two_skills_act_in_turn_as_their_motions_end(cart: MakeCart) -> None:
    one = cart(reach=asking(move(), move(), move()), drive=asking(roll(), roll()))
    one.plant.durations = [1.0, 1.75, 1.0, 1.75, 1.0]
    reach, drive = one.start("reach"), one.start("drive")
    assert one.executor.wait() == Ended(reach, StepResult(FINISHED, "", allowed=3))
    assert one.plant.time == 3.0
    assert one.executor.wait() == Ended(drive, StepResult(FINISHED, "", allowed=2))
    assert one.begun() == ["move", "roll", "move", "roll", "move"]
    assert one.plant.count("stop") == 0
    assert one.calls("skill_ended") == [("cart.reach", True), ("cart.drive", True)]


def test_a_decision_names_the_decisions_on_what_was_under_way(cart: MakeCart) -> None:
    one = cart(reach=asking(move()), drive=asking(roll()), look=asking(act("wait", duration=1.0)))
    for skill in ("reach", "drive"):
        one.start(skill)
    one.ends(2)
    first, second = one.records("decision")
    assert "beside" not in first
    assert second["beside"] == [first["sequence"]]


def test_who_needs_what_another_holds_waits_its_turn(cart: MakeCart) -> None:
    one = cart(reach=asking(move()), drive=asking(roll()))
    first, second, third = one.start("reach"), one.start("reach"), one.start("drive")
    assert [one.executor.wait(), one.executor.wait(), one.executor.wait()] == [
        Ended(step, StepResult(FINISHED, "", allowed=1)) for step in (first, second, third)
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


def test_what_is_waited_for_may_not_come_in_time(cart: MakeCart) -> None:
    one = cart(reach=asking(move()))
    one.plant.duration = 4.0
    reach = one.start("reach")
    assert one.executor.wait(3.0) is None
    assert one.plant.time == 3.0
    assert one.executor.wait(3.0) is None
    assert one.executor.wait(5.0) == Ended(reach, StepResult(FINISHED, "", allowed=1))


def test_waiting_for_nothing_is_a_mistake(cart: MakeCart) -> None:
    with pytest.raises(MisuseError):
        cart().executor.wait()


def test_one_step_can_be_waited_for_while_another_goes_on(cart: MakeCart) -> None:
    one = cart(reach=asking(move()), drive=asking(roll(), roll()))
    drive = one.start("drive")
    assert one.executor.submit(StepRequest("cart", "reach", {})).status is FINISHED
    assert one.executor.wait() == Ended(drive, StepResult(FINISHED, "", allowed=2))


# What is decided together.


@pytest.mark.parametrize("mode", GateMode)
@pytest.mark.parametrize(
    ("first", "second", "values", "reason"),
    [
        ("reach", "drive", {}, None),
        ("drive", "reach", {}, None),
        ("reach", "drive", {"charge": 0.1}, "AE751 charge-for-both"),
        ("drive", "reach", {"charge": 0.1}, "AE751 charge-for-both"),
        ("reach", "drive", {"fast": True}, "AE751 not-fast-together"),
        ("drive", "reach", {"fast": True}, "AE751 not-fast-together"),
        ("reach", "drive", {"charge": nan}, "AE704 charge"),
        ("reach", "drive", {"charge": None}, "AE703 charge"),
        ("drive", "reach", {"hand": None}, "AE703 hand"),
    ],
)
def test_what_each_may_do_alone_is_decided_of_both_together(
    cart: MakeCart, mode: GateMode, first: str, second: str, values: dict[str, Any], reason: str | None
) -> None:
    speed = 0.75 if values.get("fast") else 0.25
    one = cart(mode=mode, reach=asking(move(speed)), drive=asking(roll(speed)))
    one.plant.values |= {name: value for name, value in values.items() if name in one.plant.values}
    one.plant.values = {name: value for name, value in one.plant.values.items() if value is not None}
    alone = one.executor.submit(StepRequest("cart", second, {}))
    # A reading that is no value is denied whoever asks.
    assert (alone.status is FINISHED) == (values.get("charge") is not nan)
    if values.get("charge") is nan:
        return
    begun, beside = one.start(first), one.start(second)
    results = one.ends(2)
    assert results[begun].status is FINISHED
    if reason is None:
        assert results[beside].status is FINISHED
    else:
        assert results[beside].status is StepStatus.DENIED
        assert results[beside].reason.startswith(reason)
    assert one.calls("skill_ended").count((f"cart.{second}", reason is None)) == 1 + (reason is None)
    one.assert_nothing_is_held()
    for again in GateMode:
        replay = replayed(one.log, again)
        assert (replay.disagreements, replay.agreed) == ([], 3)


def test_a_replay_notices_a_decision_that_was_not_of_both(cart: MakeCart) -> None:
    one = cart(reach=asking(move(0.75)), drive=asking(roll(0.75)))
    one.start("reach")
    one.start("drive")
    one.ends(2)
    replay = replayed(one.log, change=lambda record: {**record, "details": _alone(record["details"])})
    (found,) = replay.disagreements
    assert (found.recorded["verdict"], (found.again or {})["verdict"]) == ("DENY", "ALLOW")


def test_a_replay_says_what_it_lacks(cart: MakeCart) -> None:
    one = cart(reach=asking(move()), drive=asking(roll()))
    one.start("reach")
    one.start("drive")
    one.ends(2)
    replay = replayed(one.log, change=lambda record: record if "beside" in record["details"] else None)
    (found,) = replay.disagreements
    assert "which is none of an action that began" in found.why


def test_a_gate_whose_ways_disagree_about_both_halts_everything(
    cart: MakeCart, monkeypatch: pytest.MonkeyPatch
) -> None:
    one = cart(mode=GateMode.SHADOW, reach=asking(move()), drive=asking(roll()))
    shadow = one.executor._deciding._gate._shadow
    assert shadow is not None

    def denying(*_: Any) -> Decision:
        return Decision(Verdict.DENY, None, ())

    monkeypatch.setattr(shadow, "decide_beside", denying)
    one.start("reach")
    one.start("drive")
    with pytest.raises(InternalError, match="compiled gate"):
        one.executor.wait()
    assert one.calls("skill_ended") == [("cart.reach", False), ("cart.drive", False)]


def test_two_actions_on_one_actuator_are_denied_whoever_holds_it(cart: MakeCart) -> None:
    readings = {"stop_pressed": Reading(False, 1.0)}
    lift = Begun(act("lift", height=1.0), readings, 1.0, 7)
    for mode in GateMode:
        gate = Gate(configuration(), mode)
        decided = gate.decide_beside(Decision(Verdict.ALLOW, move(), ()), readings, 1.0, [lift])
        assert [(reason.code, reason.rule) for reason in decided.reasons] == [("AE752", "arm")]
        denied = Decision(Verdict.DENY, None, ())
        assert gate.decide_beside(denied, readings, 1.0, [lift]) == denied


PLAN = Trajectory(
    Body(((0.0, 0.0, 0.0),), (0.5, 0.0, 0.5), (Ball("arm", 1, (0.0, 0.0, 0.0), 0.1),)),
    ((((0.0,),) * 4,),),
    (0.0, 0.0, 0.0),
    (0.0, 0.0, 0.0),
    1.0,
)


def _with_motions() -> Configuration:
    """Moves and rolls are decided as whole motions, of one joint."""
    one, rates = (Fraction(1),), (Fraction(1),) * 3
    policy = MotionPolicy(
        kinds={kind: MotionKind(None, None, None) for kind in ("move", "roll")},
        starts_at="joint_angle",
        starts_within=Fraction(1, 100),
        ends_within=Fraction(1, 100),
        lowest=(Fraction(-2),),
        highest=(Fraction(2),),
        rates=(one, one, one),
        tool=ToolLimits(rates, rates),
        clearance=Fraction(0),
        barriers=(),
    )
    joints = FamilyType(EnumType("joints", ("shoulder",)), RealType(ANGLE))
    angle = declare("joint_angle", joints, t.Role.STATE, max_age=Fraction(1))
    site = configuration().site
    site = replace(site, motion=policy, state={**site.state, "joint_angle": angle})
    return replace(configuration(), site=site)


@pytest.mark.parametrize("second", [PLAN, Motionless("it turns wheels that carry nothing")])
def test_a_second_motion_of_the_robot_is_denied_and_what_moves_nothing_of_it_is_not(
    tmp_path: Path, second: Trajectory | Motionless
) -> None:
    bodies = {"reach": asking(move()), "drive": asking(roll())}
    one = Cart(tmp_path / "audit.jsonl", bodies, under=_with_motions())
    one.plant.values["joint_angle"] = (0.0,)
    one.plant.planned = PLAN
    reach, drive = one.start("reach"), one.start("drive")
    plan = one.plant.plan
    one.plant.plan = lambda action: plan(action) if action.kind == "move" else second  # type: ignore[method-assign]
    results = one.ends(2)
    assert results[reach].status is FINISHED
    assert results[drive].status is (StepStatus.DENIED if second is PLAN else FINISHED)
    if second is PLAN:
        assert results[drive].reason.startswith("AE764 roll: the robot moves already")
        assert one.records("decision")[-1]["gate"]["verdict"] == "ALLOW"
    one.audit.close()


# What happens while both are under way.


def test_what_both_obeyed_and_break_at_a_tick_is_a_protective_stop_of_both(cart: MakeCart) -> None:
    ends: list[str] = []
    one = cart(
        reach=asking(move(), ends=ends, name="reach"),
        drive=asking(roll(), ends=ends, name="drive"),
        look=asking(act("wait", duration=1.0)),
    )
    reach, drive = one.start("reach"), one.start("drive")
    one.plant.during = [{"charge": 0.3}, {"charge": 0.1}]
    expected = StepResult(StepStatus.STOPPED, "monitor:charge-for-both", allowed=1)
    assert one.ends(2) == {reach: expected, drive: expected}
    assert ends == ["reach", "drive"]
    assert one.calls("skill_ended") == [("cart.reach", False), ("cart.drive", False)]
    one.assert_nothing_is_held()
    one.plant.during = [{"charge": 0.1}]
    assert one.executor.submit(StepRequest("cart", "reach", {})).status is FINISHED


@pytest.mark.parametrize("measured", [{"charge": nan}, {"charge": "full"}, {"unheard_of": 1.0}])
def test_what_cannot_be_read_at_a_tick_is_one_too(cart: MakeCart, measured: dict[str, Any]) -> None:
    one = cart(reach=asking(move()), drive=asking(roll()))
    one.start("reach")
    one.start("drive")
    one.plant.during = [measured]
    (name,) = measured
    assert {result.reason for result in one.ends(2).values()} == {f"monitor:input:{name}"}


def test_a_step_that_is_cancelled_comes_to_rest_and_the_other_goes_on(cart: MakeCart) -> None:
    ends: list[str] = []
    one = cart(reach=asking(move(), move(), ends=ends, name="reach"), drive=asking(roll(), roll()))
    reach, drive = one.start("reach"), one.start("drive")
    assert one.executor.wait(0.05) is None
    one.executor.cancel(reach, "not wanted")
    one.executor.cancel(reach, "not wanted at all")
    assert one.executor.wait() == Ended(reach, StepResult(StepStatus.CANCELLED, "not wanted", allowed=1))
    assert ends == ["reach"]
    assert one.calls("halt") == [1]
    assert one.plant.count("stop") == 0
    assert one.executor.wait() == Ended(drive, StepResult(FINISHED, "", allowed=2))
    one.executor.cancel(reach, "it has ended")
    one.assert_nothing_is_held()


def test_a_step_that_never_began_is_cancelled_without_a_trace_on_the_plant(cart: MakeCart) -> None:
    one = cart(reach=asking(move()))
    first, second = one.start("reach"), one.start("reach")
    assert one.executor.wait(0.05) is None
    one.executor.cancel(second, "not wanted")
    assert one.ends(1) == {second: StepResult(StepStatus.CANCELLED, "not wanted")}
    assert one.ends(1)[first].status is FINISHED
    assert one.calls("skill_began") == ["cart.reach"]
    assert [one["reason"] for one in one.records("step-refused")] == ["not wanted"]


def test_one_that_is_late_is_halted_and_the_other_goes_on(cart: MakeCart) -> None:
    one = cart(reach=asking(move()), drive=asking(roll(), roll()))
    one.plant.durations = [20.0, 6.0, 6.0]
    reach, drive = one.start("reach"), one.start("drive")
    results = one.ends(2)
    assert results[reach] == StepResult(
        StepStatus.TIMED_OUT, "the skill's time-out passed during a motion", allowed=1
    )
    assert results[drive].status is StepStatus.TIMED_OUT  # at 10 s, amid its second
    assert one.plant.time == 10.0


def test_a_denied_step_leaves_what_the_other_moves_alone(cart: MakeCart) -> None:
    one = cart(reach=asking(move(), move(5.0)), drive=asking(roll()))
    one.plant.durations = [0.5, 5.0]
    reach, drive = one.start("reach"), one.start("drive")
    results = one.ends(2)
    assert (results[reach].status, results[drive].status) == (StepStatus.DENIED, FINISHED)
    assert one.plant.count("stop") == 0
    assert one.plant.count("halt") == 0


def test_a_protective_stop_that_a_skill_asks_for_ends_what_the_others_move(cart: MakeCart) -> None:
    one = cart(reach=asking(move()), drive=asking(roll()), look=asking(act("stop")))
    reach, drive = one.start("reach"), one.start("drive")
    assert one.executor.wait(0.05) is None
    assert one.executor.submit(StepRequest("cart", "look", {})).status is FINISHED
    results = one.ends(2)
    assert "beside" not in one.records("decision")[-1]
    for step in (reach, drive):
        assert results[step].status is StepStatus.STOPPED
        assert "which asks for a protective stop" in results[step].reason
    one.assert_nothing_is_held()


def test_what_the_operator_revokes_is_halted_and_the_other_goes_on(cart: MakeCart) -> None:
    operator = Operator()
    one = cart(governor=operator, reach=asking(move()), drive=asking(roll(), roll()))
    reach, drive = one.start("reach"), one.start("drive")
    assert one.executor.wait(0.05) is None
    operator.generation, operator.revoked = 1, {"reach"}
    results = one.ends(2)
    assert results[reach] == StepResult(StepStatus.STOPPED, "revoked: the test says so", allowed=1)
    assert results[drive].status is FINISHED
    one.assert_nothing_is_held()


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


def test_while_the_operator_pauses_what_moves_ends_and_nothing_begins(cart: MakeCart) -> None:
    operator = Operator()
    one = cart(governor=operator, reach=asking(move(), move()), drive=asking(roll(), roll()))
    one.plant.durations = [1.0, 3.0]
    one.start("reach")
    one.start("drive")
    assert one.executor.wait(0.5) is None
    operator.command = Command.PAUSE
    assert one.executor.wait(3.0) is None
    assert one.begun() == ["move", "roll"]
    operator.command = Command.RUN
    assert {result.status for result in one.ends(2).values()} == {FINISHED}
    assert [len(one.records(event)) for event in ("paused", "resumed")] == [1, 1]


def test_a_stop_by_the_operator_ends_everything(cart: MakeCart) -> None:
    operator = Operator()
    one = cart(governor=operator, reach=asking(move()), drive=asking(roll()))
    one.start("reach")
    one.start("drive")
    assert one.executor.wait(0.05) is None
    operator.command = Command.STOP
    assert {result.reason for result in one.ends(2).values()} == {"monitor:the operator stops it"}
    one.assert_nothing_is_held()


# However it ends.


def _raising(observed: Observation, inputs: Inputs) -> SkillBody:
    yield move()
    raise ValueError("no")


@pytest.mark.parametrize(
    ("body", "status"),
    [
        (asking(move()), FINISHED),
        (asking(move(), roll()), StepStatus.DENIED),
        (_raising, StepStatus.RAISED),
        (asking(*[move()] * 500), StepStatus.TIMED_OUT),
        (asking(act("fly")), StepStatus.DENIED),
    ],
)
def test_what_a_step_held_is_there_for_the_next(cart: MakeCart, body: Asking, status: StepStatus) -> None:
    one = cart(reach=body)
    first, second = one.start("reach"), one.start("reach")
    results = one.ends(2)
    assert (results[first].status, results[second].status) == (status, status)
    one.assert_nothing_is_held()
    assert one.calls("skill_ended") == [("cart.reach", status is FINISHED)] * 2


@pytest.mark.parametrize(
    ("returned", "status", "said"),
    [
        (None, FINISHED, {}),
        ({"amount": 0.5}, FINISHED, {"amount": 0.5}),
        ({"amount": 1}, FINISHED, {"amount": 1.0}),
        ({}, StepStatus.RAISED, "the output `amount` is missing"),
        ({"amount": 1.5}, StepStatus.RAISED, "the output `amount` is outside its range [0, 1]"),
        ({"amount": nan}, StepStatus.RAISED, "the output `amount` is not a finite number"),
        ({"amount": True}, StepStatus.RAISED, "the output `amount` is not a finite number"),
        ({"amount": 0.5, "more": 1}, StepStatus.RAISED, "the skill has no output `more`"),
        ([0.5], StepStatus.RAISED, "the skill returned a `list`"),
        ({1: 0.5}, StepStatus.RAISED, "the skill returned an output whose name is no text"),
    ],
)
def test_what_a_skill_gives_is_what_it_declares(
    cart: MakeCart, returned: Any, status: StepStatus, said: Any
) -> None:
    def giving(observed: Observation, inputs: Inputs) -> SkillBody:
        yield act("wait", duration=1.0)
        return returned

    one = cart(look=giving)
    result = one.executor.submit(StepRequest("cart", "look", {}))
    assert result.status is status
    if status is FINISHED:
        assert result.outputs == said
        assert [end.get("outputs", {}) for end in one.records("step-ended")] == [said]
    else:
        assert said in result.reason
        assert result.outputs == {}


@pytest.mark.parametrize("failure", [OSError("link lost"), KeyboardInterrupt()])
@pytest.mark.parametrize("method", ["advance", "begin", "observe"])
def test_where_something_breaks_every_step_is_cleaned_up_once(
    cart: MakeCart, method: str, failure: BaseException
) -> None:
    ends: list[str] = []
    one = cart(
        reach=asking(move(), move(), ends=ends, name="reach"),
        drive=asking(roll(), roll(), ends=ends, name="drive"),
    )
    one.plant.durations = [1.0, 2.0]
    one.start("reach")
    one.start("drive")
    waiting = one.start("reach")
    assert one.executor.wait(0.5) is None
    one.plant.failing[method] = failure
    with pytest.raises(type(failure)):
        one.executor.wait()
    assert sorted(ends) == ["drive", "reach"]
    assert one.plant.count("stop") == 1
    assert one.calls("skill_ended") == [("cart.reach", False), ("cart.drive", False)]
    assert len(one.records("step-broken")) == 3
    one.assert_nothing_is_held()
    one.executor.cancel(waiting, "it is gone")
    with pytest.raises(MisuseError):
        one.executor.wait()


def test_steps_that_are_left_behind_are_cleaned_up(cart: MakeCart) -> None:
    ends: list[str] = []
    one = cart(reach=asking(move(), ends=ends), drive=asking(roll(), ends=ends))
    with one.executor:
        one.start("reach")
        one.start("drive")
        assert one.executor.wait(0.05) is None
    assert len(ends) == 2
    assert one.plant.count("stop") == 1
    one.assert_nothing_is_held()


def test_a_resource_that_the_site_does_not_have_is_refused(cart: MakeCart) -> None:
    one = cart(reach=asking(move()))
    one.executor._resources.under({"arm": 1, "camera": 0, "actuator arm": 1})
    refused = one.executor.start(StepRequest("cart", "reach", {}))
    assert refused == StepResult(StepStatus.REFUSED, "this site has no `camera`")
