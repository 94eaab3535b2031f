"""Planned motions, executed on the robot without physics: plans, arrivals, and refusals with a reason."""

from __future__ import annotations

from collections.abc import Callable
from math import ceil, dist, hypot, pi
from typing import Any

import numpy as np
import pytest

from aeros.runtime.ports import MotionCompletion, NoMotion, Trajectory
from aeros.sim.clock import TICK
from aeros.sim.fixed_step_plant import _PLANNERS as PLANNERS
from aeros.sim.geometry import Vector3
from aeros.sim.kinematic.objects import ObjectSet, Surface, slab
from aeros.sim.kinematic.robot import KinematicRobot
from aeros.sim.robot.errors import ActionRejectedError, BlockedError
from aeros.sim.robot.limits import Vector
from aeros.sim.robot.motions import ActionParameters, PreparedMotion, plan_base_lines, plan_tool_lines
from aeros.sim.robot.robot import BRAKED_PARTS, RobotOptions, RobotState
from tests.unit.sim.robot.panda import PANDA, PANDA_BODY, Q_MAX, QD_MAX

BASE: Vector3 = (1.0, 2.0, 0.5)
AT = (1.5, 2.1, 0.8)
"""Half a metre ahead of the base, a little to the left, 0.3 m high."""

BASE_HIGH = (1.4, 1.8, 0.9)

JOINTS: dict[str, Any] = {"q1": 0.2, "q2": -0.5, "q3": 0.1, "q4": -2.0, "q5": 0.2, "q6": 1.8, "q7": 0.6}


class Fixed(KinematicRobot):
    """It stands where it is, whatever it is commanded; its fingers never rest."""

    def tick(self) -> None:
        pass

    def read_sensors(self) -> RobotState:
        return super().read_sensors()._replace(finger_speed=0.05)


def robot(
    *slabs: Surface, carriage: bool = True, kind: type[KinematicRobot] = KinematicRobot
) -> KinematicRobot:
    return kind(RobotOptions(PANDA, carriage=carriage, base=BASE), ObjectSet((), slabs))


def planned(
    of: KinematicRobot, kind: str, base_motion: Trajectory | None = None, **values: Any
) -> PreparedMotion:
    return PLANNERS[kind](of, ActionParameters(values), base_motion)


def trajectory(prepared: PreparedMotion) -> Trajectory:
    assert isinstance(prepared.plan, Trajectory)
    return prepared.plan


def run(of: KinematicRobot, prepared: PreparedMotion, seen: Callable[[], None] = lambda: None) -> int:
    """Execute a motion; the number of its ticks."""
    count = 0
    for _ in prepared.motion:
        of.tick()
        seen()
        count += 1
    return count


def refused(kind: str, base_motion: Trajectory | None = None, *, carriage: bool = True, **values: Any) -> str:
    of = robot(carriage=carriage)
    with pytest.raises(ActionRejectedError) as why:
        planned(of, kind, base_motion, **values)
    assert of.read_sensors() == robot(carriage=carriage).read_sensors()
    return str(why.value)


# What every kind refuses.

VALID: dict[str, dict[str, Any]] = {
    "stop": {},
    "wait": {"duration": 1.0},
    "move_tool": {"target": AT, "yaw": 0.0, "speed": 0.5},
    "move_joints": {**JOINTS, "speed": 0.5},
    "grip": {"width": 0.02, "force": 10.0},
    "slide": {"target": AT, "force": 5.0, "speed": 0.1},
    "move_base": {"x": 1.5, "y": 2.0, "speed": 0.5},
}


def test_every_kind_has_a_planner() -> None:
    assert set(PLANNERS) == set(VALID)


@pytest.mark.parametrize("kind", VALID)
def test_a_missing_or_unknown_parameter_is_refused(kind: str) -> None:
    assert refused(kind, **VALID[kind], more=1.0) == "unknown parameter: `more`"
    for name in VALID[kind]:
        less = {other: value for other, value in VALID[kind].items() if other != name}
        assert refused(kind, **less) == f"missing parameter: `{name}`"


@pytest.mark.parametrize(
    ("kind", "name", "low", "high"),
    [
        ("wait", "duration", 0.0, 600.0),
        ("move_tool", "yaw", -pi, pi),
        ("move_tool", "speed", 0.001, 1.7),
        ("move_joints", "q2", -1.7628, 1.7628),
        ("move_joints", "speed", 0.001, 1.7),
        ("grip", "width", 0.0, 0.08),
        ("grip", "force", 0.1, 70.0),
        ("slide", "force", 0.5, 60.0),
        ("slide", "speed", 0.001, 0.5),
        ("move_base", "x", -10.0, 10.0),
        ("move_base", "y", -10.0, 10.0),
        ("move_base", "speed", 0.001, 1.0),
    ],
)
def test_a_parameter_out_of_its_range_is_refused(kind: str, name: str, low: float, high: float) -> None:
    step = 1e-6 * max(1.0, abs(high))
    for value in (low - step, high + step):
        assert refused(kind, **{**VALID[kind], name: value}).startswith(
            f"out of range: `{name}` is outside ["
        )
    for value in (low, high):
        if kind not in ("move_joints", "move_tool", "slide"):
            planned(robot(), kind, **{**VALID[kind], name: value})


# Motions that move neither arm nor base.


@pytest.mark.parametrize(("duration", "ticks"), [(0.0, 0), (0.5, 120), (0.5001, 121), (0.001, 1)])
def test_a_wait_takes_as_many_ticks_as_cover_it(duration: float, ticks: int) -> None:
    one = robot()
    prepared = planned(one, "wait", duration=duration)
    assert prepared.plan == NoMotion("wait: nothing moves")
    assert prepared.moved_parts == frozenset()
    assert run(one, prepared) == ticks


def test_a_stop_brakes_arm_and_base() -> None:
    one = robot()
    rates = np.zeros(7)
    rates[0] = 0.3
    one.command(one.q_command, rates)
    one.command_base(np.zeros(2), np.array([0.1, 0.0]))
    one.tick()
    prepared = planned(one, "stop")
    assert isinstance(prepared.plan, NoMotion)
    assert prepared.moved_parts == BRAKED_PARTS
    run(one, prepared)
    assert not one.qd_command.any()
    assert not one.base_speed_command.any()


def test_a_grip_ends_when_the_fingers_have_rested_for_a_tenth_of_a_second() -> None:
    one = robot()
    prepared = planned(one, "grip", width=0.06, force=10.0)
    assert prepared.plan == NoMotion("grip: only the fingers move")
    assert prepared.moved_parts == frozenset()
    # 20 mm at 0.1 m/s are 48 ticks; then 24 at rest.
    assert run(one, prepared) == pytest.approx(48 + 24, abs=1)
    assert one.read_sensors().finger_gap == pytest.approx(0.06)


def test_fingers_that_never_rest_are_blocked_after_two_seconds() -> None:
    one = robot(kind=Fixed)
    with pytest.raises(BlockedError, match="blocked: the fingers do not come to rest"):
        run(one, planned(one, "grip", width=0.06, force=10.0))


# The arm.


def test_a_tool_goes_straight_to_its_target_no_faster_than_asked() -> None:
    one = robot()
    prepared = planned(one, "move_tool", target=AT, yaw=0.4, speed=0.3)
    plan = trajectory(prepared)
    assert (plan.body, plan.base, plan.base_path, plan.servo) == (PANDA_BODY, BASE, (0.0, 0.0, 0.0), None)
    assert prepared.moved_parts == {"arm"}
    start = one.read_sensors().tool_position
    places: list[Vector3] = []
    speeds: list[float] = []

    def note() -> None:
        places.append(one.read_sensors().tool_position)
        speeds.append(one.read_sensors().tool_speed)

    ticks = run(one, prepared, note)
    assert ticks == round(plan.duration / TICK) + 1  # and a tick to settle
    assert places[-1] == pytest.approx(AT, abs=1e-4)
    assert one.tool_command()[1] == pytest.approx(0.4, abs=1e-3)
    assert 0.29 < max(speeds) <= 0.3001
    way = (np.array(AT) - start) / dist(AT, start)
    off = [np.linalg.norm(np.cross(np.array(place) - start, way)) for place in places]
    assert max(off) < 2e-4
    assert plan.duration == pytest.approx(1.875 * dist(AT, start) / 0.3, rel=0.05)


def test_a_yaw_is_taken_the_shorter_way_round() -> None:
    one = robot()
    run(one, planned(one, "move_tool", target=AT, yaw=2.5, speed=0.5))
    swept: list[float] = []
    # 0.2 rad across the cut at half a turn would be 6 the other way.
    run(
        one,
        planned(one, "move_tool", target=AT, yaw=2.7, speed=0.5),
        lambda: swept.append(one.tool_command()[1]),
    )
    assert all(2.4 < yaw < 2.8 for yaw in swept)
    turned = planned(one, "move_tool", target=AT, yaw=-2.7, speed=0.5)
    assert trajectory(turned).duration < 2.0


def test_a_target_out_of_reach_is_refused_with_the_place() -> None:
    assert refused("move_tool", target=(3.0, 2.0, 0.8), yaw=0.0, speed=0.5).startswith("unreachable: ")
    assert refused("slide", target=(3.0, 2.0, 0.8), force=5.0, speed=0.1).startswith("unreachable: ")


def test_a_tool_that_is_held_back_is_blocked() -> None:
    one = robot(kind=Fixed)
    away = dist(one.read_sensors().tool_position, AT)
    with pytest.raises(BlockedError, match=f"blocked: the tool stopped {1000 * away:.0f} mm from its target"):
        run(one, planned(one, "move_tool", target=AT, yaw=0.0, speed=0.5))


def test_joints_move_in_step_to_their_targets() -> None:
    one = robot()
    prepared = planned(one, "move_joints", **JOINTS, speed=0.3)
    assert prepared.moved_parts == {"arm"}
    start, shares, speeds = one.q_command.copy(), [], []
    goal = np.array(list(JOINTS.values()))

    def note() -> None:
        share = (np.array(one.read_sensors().q) - start) / (goal - start)
        shares.append(float(np.ptp(share)))
        speeds.append(one.read_sensors().tool_speed)

    run(one, prepared, note)
    assert one.read_sensors().q == pytest.approx(goal)
    assert max(shares) < 1e-9
    assert 0.25 < max(speeds) <= 0.3
    assert trajectory(prepared).joint_paths[0][-1][3] == pytest.approx(goal)


def test_joints_that_are_held_back_are_blocked() -> None:
    one = robot(kind=Fixed)
    with pytest.raises(BlockedError, match=r"blocked: a joint stopped 0\.\d{3} rad from its target"):
        run(one, planned(one, "move_joints", **JOINTS, speed=0.5))


def test_a_joint_may_be_asked_to_its_limit_and_no_further() -> None:
    most = float(Q_MAX[6])
    planned(robot(), "move_joints", **{**JOINTS, "q7": most}, speed=0.5)
    assert "`q7`" in refused("move_joints", **{**JOINTS, "q7": most + 1e-6}, speed=0.5)


# While the base drives.

DRIVE = Trajectory(PANDA_BODY, ((((0.0,) * 7,) * 4,),), BASE, (0.3, -0.4, 0.0), 5.0)
"""Half a metre in 5 s: 0.1875 m/s at its peak."""


def test_a_target_is_seen_from_where_the_base_comes_to_rest() -> None:
    one = robot()
    there = (AT[0] + 0.3, AT[1] - 0.4, AT[2])
    driving = trajectory(planned(one, "move_tool", DRIVE, target=there, yaw=0.0, speed=0.5))
    slower = trajectory(planned(one, "move_tool", target=AT, yaw=0.0, speed=0.5 - 0.1875))
    assert driving.joint_paths == slower.joint_paths
    assert driving.duration == slower.duration
    assert driving.base == BASE
    joints = trajectory(planned(one, "move_joints", DRIVE, **JOINTS, speed=0.5))
    assert joints == trajectory(planned(one, "move_joints", **JOINTS, speed=0.5 - 0.1875))


@pytest.mark.parametrize("kind", ["move_tool", "move_joints"])
def test_a_base_that_is_as_fast_as_the_tool_may_be_leaves_nothing(kind: str) -> None:
    why = "out of range: the base alone moves the tool at 0.188 m/s"
    assert refused(kind, DRIVE, **{**VALID[kind], "speed": 0.188}) == why
    planned(robot(), kind, DRIVE, **{**VALID[kind], "speed": 0.189})


def test_nothing_is_pressed_while_the_base_drives() -> None:
    why = "not allowed while the base drives: the pressed object would be dragged"
    assert refused("slide", DRIVE, **VALID["slide"]) == why


def test_an_arm_waits_for_the_base_before_it_has_arrived() -> None:
    one = robot()
    drive = planned(one, "move_base", x=1.5, y=2.0, speed=0.5)
    reach = planned(
        one, "move_tool", trajectory(drive), target=(AT[0] + 0.5, AT[1], AT[2]), yaw=0.0, speed=1.2
    )
    ticks = 0
    while next(reach.motion, True) is None:
        next(drive.motion, None)
        one.tick()
        ticks += 1
    assert ticks * TICK > trajectory(drive).duration
    assert one.read_sensors().tool_position == pytest.approx((AT[0] + 0.5, AT[1], AT[2]), abs=1e-4)


# The base.


def test_a_base_drives_straight_and_no_faster_than_asked() -> None:
    one = robot()
    prepared = planned(one, "move_base", x=1.6, y=1.2, speed=0.4)
    plan = trajectory(prepared)
    assert prepared.moved_parts == {"base"}
    assert plan.base_path == pytest.approx((0.6, -0.8, 0.0))
    assert plan.base == BASE
    assert plan.joint_paths == (((tuple(one.q_command.tolist()),) * 4,),)
    assert plan.duration == pytest.approx(ceil(1.875 / 0.4 / 0.999 / TICK) * TICK, abs=2 * TICK)
    speeds: list[float] = []
    ticks = run(one, prepared, lambda: speeds.append(hypot(*one.read_sensors().base_velocity)))
    assert ticks == round(plan.duration / TICK) + 60
    assert one.read_sensors().base_position == pytest.approx((1.6, 1.2, 0.5))
    assert 0.39 < max(speeds) <= 0.4
    assert not one.base_speed_command.any()


def test_a_short_drive_is_as_slow_as_its_acceleration_allows() -> None:
    # 5.7736·d/T² = 0.999 m/s².
    plan = trajectory(planned(robot(), "move_base", x=1.04, y=2.0, speed=1.0))
    assert plan.duration == pytest.approx((5.7736 * 0.04 / 0.999) ** 0.5, abs=TICK)
    here = trajectory(planned(robot(), "move_base", x=1.0, y=2.0, speed=1.0))
    assert here.duration == TICK
    assert here.base_path == (0.0, 0.0, 0.0)


def test_a_second_drive_begins_where_the_first_has_ended() -> None:
    one = robot()
    run(one, planned(one, "move_base", x=1.5, y=2.0, speed=0.5))
    plan = trajectory(planned(one, "move_base", x=1.5, y=2.5, speed=0.5))
    assert plan.base == pytest.approx((1.5, 2.0, 0.5))
    assert plan.base_path == pytest.approx((0.0, 0.5, 0.0))


def test_a_robot_without_a_carriage_does_not_drive() -> None:
    why = "unknown kind: `move_base` on a robot without a carriage"
    assert refused("move_base", carriage=False, **VALID["move_base"]) == why


def test_a_base_that_is_held_back_is_blocked() -> None:
    one = robot(kind=Fixed)
    with pytest.raises(BlockedError, match="blocked: the base stopped 500 mm from its target"):
        run(one, planned(one, "move_base", x=1.5, y=2.0, speed=0.5))


# In contact.

TABLE = slab(1.5, 2.0, 0.77, 2.0, 2.0)
"""Its top is 0.77 m high: 30 mm below `AT`; the closed tips reach 9 mm below the tool."""

TOUCH = (1.5, 2.0, 0.784)
"""5 mm above contact."""


def sliding(*slabs: Surface, **values: Any) -> tuple[KinematicRobot, PreparedMotion]:
    one = robot(*slabs)
    run(one, planned(one, "move_tool", target=TOUCH, yaw=0.0, speed=0.5))
    return one, planned(one, "slide", **{"target": (1.5, 2.1, 0.77), "force": 6.0, "speed": 0.1, **values})


def test_a_slide_plans_a_path_for_each_height_and_states_its_bounds() -> None:
    _, prepared = sliding(TABLE)
    plan = trajectory(prepared)
    assert prepared.moved_parts == {"arm"}
    # Down to 20 mm below the target, then along every 5 mm, to one above the start.
    assert len(plan.joint_paths) == 1 + ceil((0.784 - 0.75) / 0.005) + 1
    assert plan.servo is not None
    assert plan.servo.joint_tolerance == (0.01,) * 7
    assert plan.servo.speed == tuple((QD_MAX / 2.0).tolist())
    mean = 0.1 / plan.duration
    assert plan.servo.tool_speed == pytest.approx(hypot(1.875 * mean, 0.006))
    assert plan.servo.tool_speed <= 0.1
    assert plan.servo.tool_acceleration == pytest.approx(hypot(5.7736 * mean / plan.duration, 0.5))
    assert plan.servo.tool_jerk == pytest.approx(hypot(60.0 * mean / plan.duration**2, 240.0))


def test_a_slide_presses_with_its_force_along_the_surface() -> None:
    one, prepared = sliding(TABLE)
    seen: list[tuple[float, Vector3]] = []
    run(one, prepared, lambda: seen.append((one.wrist_vertical_force(), one.read_sensors().tool_position)))
    loads = [load for load, _ in seen]
    assert loads[-1] == pytest.approx(6.0, abs=0.3)
    assert max(loads) < 9.0
    assert seen[-1][1][:2] == pytest.approx((1.5, 2.1), abs=1e-3)
    first = next(place for load, place in seen if load > 0.0)
    assert first[:2] == pytest.approx((1.5, 2.0), abs=1e-3)


def test_a_slide_takes_half_a_second_at_least() -> None:
    _, prepared = sliding(TABLE, target=(1.5, 2.0, 0.77))
    assert trajectory(prepared).duration == 0.5


def test_a_slide_over_nothing_ends_20_mm_below_its_target() -> None:
    one, prepared = sliding()
    with pytest.raises(BlockedError, match="no contact: no surface down to 20 mm below the target"):
        run(one, prepared)
    assert one.read_sensors().tool_position[2] == pytest.approx(0.75, abs=1e-3)


def test_a_slide_over_an_edge_loses_contact() -> None:
    edge = slab(1.5, 1.93, 0.77, 0.2, 0.2)  # up to y = 2.03
    one, prepared = sliding(edge, target=(1.5, 2.2, 0.785), speed=0.02)
    with pytest.raises(BlockedError, match="contact lost: no surface down to 20 mm below the target"):
        run(one, prepared)


def test_a_slide_that_leaves_its_paths_is_blocked() -> None:
    one, prepared = sliding(TABLE)
    next(prepared.motion)
    one.tick()
    elsewhere = one.q_command.copy()
    elsewhere[0] += 0.05
    one.command(elsewhere, np.zeros(7))
    with pytest.raises(BlockedError, match=r"blocked: the slide leaves its planned paths by 0\.0\d+ rad"):
        run(one, prepared)


# Settling.


class Swinging(KinematicRobot):
    """Its joints rest after some ticks."""

    ticks_left = 5

    def read_sensors(self) -> RobotState:
        self.ticks_left -= 1
        rate = -0.011 if self.ticks_left > 0 else 0.0099
        return super().read_sensors()._replace(qd=(0.0, rate, 0.0, 0.0, 0.0, 0.0, 0.0))


def test_an_arm_has_settled_when_every_joint_is_slow() -> None:
    one = robot(kind=Swinging)
    assert isinstance(one, Swinging)
    one.ticks_left = 5
    assert len(list(one.settle())) == 5
    one.ticks_left = 500
    assert len(list(one.settle())) == 60
    assert len(list(robot().settle())) == 1


def test_planning_moves_nothing() -> None:
    one = robot()
    before: tuple[RobotState, Vector] = one.read_sensors(), one.q_command
    for kind, values in VALID.items():
        assert not isinstance(planned(one, kind, **values).plan, MotionCompletion)
    assert one.read_sensors() == before[0]
    assert one.q_command is before[1]


def test_lines_are_planned_one_after_the_other() -> None:
    of = robot()
    first: dict[str, Any] = {"target": AT, "yaw": 0.3, "speed": 0.2}
    second: dict[str, Any] = {"target": BASE_HIGH, "yaw": -0.2, "speed": 0.2}
    one, other = plan_tool_lines(of, [ActionParameters(first), ActionParameters(second)])
    assert isinstance(one, Trajectory)
    assert isinstance(other, Trajectory)
    assert one == trajectory(planned(of, "move_tool", **first))
    assert other.joint_paths[0][0][0] == one.joint_paths[0][-1][3]
    run(of, planned(of, "move_tool", **first))
    begun = trajectory(planned(of, "move_tool", **second))
    assert begun.joint_paths[0][-1][3] == pytest.approx(other.joint_paths[0][-1][3], abs=1e-6)


def test_lines_after_a_refused_one_are_not_planned() -> None:
    far = {"target": (9.0, 2.0, 0.8), "yaw": 0.0, "speed": 0.2}
    near = {"target": AT, "yaw": 0.0, "speed": 0.2}
    one, refusal = plan_tool_lines(robot(), [ActionParameters(each) for each in (near, far, near)])
    assert isinstance(one, Trajectory)
    assert isinstance(refusal, MotionCompletion)
    assert (refusal.reason or "").startswith("unreachable: ")


def test_ways_of_the_base_are_planned_one_after_the_other() -> None:
    of = robot()
    first: dict[str, Any] = {"x": -0.2, "y": 0.1, "speed": 0.3}
    second = {"x": -0.2, "y": 0.5, "speed": 0.3}
    far = {"x": 99.0, "y": 0.5, "speed": 0.3}
    one, other, refusal = plan_base_lines(of, [ActionParameters(each) for each in (first, second, far)])
    assert isinstance(one, Trajectory)
    assert isinstance(other, Trajectory)
    assert isinstance(refusal, MotionCompletion)
    assert one == trajectory(planned(of, "move_base", **first))
    assert other.base[:2] == (-0.2, 0.1)
    assert other.base_path == pytest.approx((0.0, 0.4, 0.0))
    assert other.joint_paths == one.joint_paths
