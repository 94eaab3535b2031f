from __future__ import annotations

from typing import Any

import pytest

from aeros.runtime.ports import MotionCompletion, NoMotion, Trajectory
from aeros.sim.robot.robot_file import read_robot
from aeros.skill import Action
from aeros.wired_arm.arm import ArmState
from aeros.wired_arm.arm_client import StreamEnd
from aeros.wired_arm.motion_table import FINGER_TIME, SETTLE_TIME, MotionTable
from tests.unit.franka.stub.arms import READY, line

STILL = (0.0,) * 7
PLAN = Trajectory(read_robot("franka_fr3").body, (line(READY, 0.05),), (0.0,) * 3, (0.0,) * 3, 0.2)
MOVE, WAIT, GRIP = (
    Action("move_joints", {}),
    Action("wait", {"duration": 0.5}),
    Action("grip", {"width": 0.0, "force": 1.0}),
)


class Arm:
    """The part of the arm that the table uses."""

    def __init__(self) -> None:
        self.state = ArmState(1.0, READY, STILL, READY, STILL, STILL, 1, 0.0)
        self.own_stop: str | None = None
        self.end: StreamEnd | None = None
        self.ended_at = 0.0
        self.calls: list[str] = []

    def start(self, plan: Trajectory) -> None:
        self.calls.append("start")

    def brake(self) -> None:
        self.calls.append("brake")

    def go_on(self, by: float, **changes: Any) -> None:
        self.state = self.state._replace(time=self.state.time + by, **changes)


class Hand:
    """The part of the hand that the table uses."""

    def __init__(self) -> None:
        self.is_busy = False
        self.failure: str | None = None

    def grip(self, gap: float, force: float) -> None:
        self.is_busy = True


def table(arm: Arm) -> MotionTable:
    return MotionTable(arm, None)  # type: ignore[arg-type]


def test_a_motion_of_the_arm_has_ended_when_it_rests_at_its_target() -> None:
    arm = Arm()
    one = table(arm)
    motion = one.add(MOVE, PLAN)
    one.begin_pending()
    assert (arm.calls, one.collect_ended()) == (["start"], {})
    arm.end, arm.ended_at = StreamEnd(None, False), 1.2
    target = PLAN.joint_paths[0][-1][3]
    arm.go_on(0.2, q=target)
    assert one.collect_ended() == {}  # no state after the last set point
    arm.go_on(0.001, dq=(0.02, *STILL[1:]))
    assert one.collect_ended() == {}
    arm.go_on(0.001, dq=STILL)
    assert one.collect_ended() == {motion: MotionCompletion(True)}
    assert len(one) == 0


def test_an_arm_that_stops_elsewhere_is_blocked() -> None:
    arm = Arm()
    one = table(arm)
    motion = one.add(MOVE, PLAN)
    one.begin_pending()
    arm.end, arm.ended_at = StreamEnd(None, False), 1.0
    arm.go_on(0.01)
    assert one.collect_ended() == {
        motion: MotionCompletion(False, "blocked: a joint stopped 0.050 rad from its target")
    }


def test_a_stop_of_the_arms_own_counts_only_for_motions_of_the_arm() -> None:
    arm = Arm()
    one = table(arm)
    one.add(WAIT, NoMotion("wait"))
    one.begin_pending()
    arm.own_stop = "late: of a motion before"
    assert one.own_stop() is None
    one.add(MOVE, PLAN)
    assert one.own_stop() is None
    one.begin_pending()
    assert one.own_stop() == "late: of a motion before"
    arm.own_stop, arm.end = None, StreamEnd("reflex", False)
    assert one.own_stop() == "reflex"
    assert set(one.end_all("reflex").values()) == {MotionCompletion(False, "reflex")}


def test_a_wait_ends_by_the_clock() -> None:
    arm = Arm()
    one = table(arm)
    motion = one.add(WAIT, NoMotion("wait"))
    one.begin_pending()
    arm.go_on(0.499)
    assert one.collect_ended() == {}
    arm.go_on(0.002)
    assert one.collect_ended() == {motion: MotionCompletion(True)}


@pytest.mark.parametrize("is_begun", [True, False])
def test_a_halted_motion_of_the_arm_is_braked_if_it_has_begun(is_begun: bool) -> None:
    arm = Arm()
    one = table(arm)
    motion = one.add(MOVE, PLAN)
    if is_begun:
        one.begin_pending()
    one.halt(motion)
    one.begin_pending()
    assert arm.calls == (["start", "brake"] if is_begun else [])
    arm.end = StreamEnd(None, True) if is_begun else None
    arm.go_on(0.5)
    assert one.collect_ended() == {motion: MotionCompletion(False, "halted")}


def test_a_stop_brakes_the_arm_and_the_arm_moves_once_at_a_time() -> None:
    arm = Arm()
    one = table(arm)
    one.add(MOVE, PLAN)
    assert one.busy_refusal(MOVE, PLAN) == "busy: the arm moves already"
    assert one.busy_refusal(GRIP, NoMotion("grip")) is None
    stop = one.add(Action("stop", {}), NoMotion("stop"))
    one.begin_pending()
    assert arm.calls == ["start", "brake"]
    assert one.collect_ended() == {stop: MotionCompletion(True)}


def test_an_arm_that_does_not_come_to_rest_has_failed() -> None:
    arm = Arm()
    one = table(arm)
    motion = one.add(MOVE, PLAN)
    one.begin_pending()
    arm.end, arm.ended_at = StreamEnd(None, True), 1.0
    arm.go_on(SETTLE_TIME - 0.01, dq=(0.5, *STILL[1:]))
    assert (one.collect_ended(), one.unrest(0.99)) == ({}, "")
    arm.go_on(0.02)
    assert not one.is_arm_at_rest()
    assert one.unrest(1.01) == "a joint still moves at 0.500 rad/s or m/s after 1 s"
    assert one.collect_ended() == {
        motion: MotionCompletion(False, "moving: a joint still moves at 0.500 rad/s or m/s after 1 s")
    }
    arm.go_on(0.001, dq=STILL)
    assert one.unrest(1.01) is None


def test_a_halted_grip_ends_when_the_fingers_rest() -> None:
    arm, hand = Arm(), Hand()
    one = MotionTable(arm, hand)  # type: ignore[arg-type]
    motion = one.add(GRIP, NoMotion("grip"))
    one.begin_pending()
    one.halt(motion)
    assert (one.collect_ended(), one.unrest(1.0)) == ({}, "")
    assert one.unrest(FINGER_TIME + 0.1) == "the fingers still move after 5.1 s"
    hand.is_busy = False
    assert one.unrest(1.0) is None
    assert one.collect_ended() == {motion: MotionCompletion(False, "halted")}
