"""Sampled points give the decided motion back, as a controller interpolates between them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.ros2_control.controller import TrajectoryPoint
from aeros.ros2_control.points import braking_points, decided_points
from aeros.runtime.ports import Trajectory
from aeros.sim.robot.motions import ActionParameters, plan_move_tool
from aeros.sim.robot.robot_file import read_robot
from aeros.wired_arm.planner import StandingRobot
from aeros.wired_arm.streamed_motion import StreamedMotion
from tests.hypothesis_profiles import examples
from tests.unit.franka.stub.arms import ACCELERATION, JERK, READY, line


def motion_of(way: float, duration: float) -> StreamedMotion:
    return StreamedMotion(line(READY, way), duration, ACCELERATION, JERK)


def interpolated(a: TrajectoryPoint, b: TrajectoryPoint, time: float) -> list[float]:
    """Positions between two points, of the quintic with their positions, speeds and accelerations.

    Source: joint_trajectory_controller/src/trajectory.cpp, `interpolate_between_points`.
    """
    t, at = b.time - a.time, time - a.time
    found = []
    for p0, v0, a0, p1, v1, a1 in zip(a.q, a.dq, a.ddq, b.q, b.dq, b.ddq, strict=True):
        third = (20 * (p1 - p0) - (8 * v1 + 12 * v0) * t - (3 * a0 - a1) * t**2) / (2 * t**3)
        fourth = (30 * (p0 - p1) + (14 * v1 + 16 * v0) * t + (3 * a0 - 2 * a1) * t**2) / (2 * t**4)
        fifth = (12 * (p1 - p0) - (6 * v1 + 6 * v0) * t - (a0 - a1) * t**2) / (2 * t**5)
        found.append(p0 + v0 * at + a0 / 2 * at**2 + third * at**3 + fourth * at**4 + fifth * at**5)
    return found


def greatest_error(motion: StreamedMotion, points: Sequence[TrajectoryPoint]) -> float:
    """Greatest distance of a joint from the motion, half-way between points, rad."""
    errors = []
    for a, b in pairwise(points):
        middle = (a.time + b.time) / 2.0
        between = zip(interpolated(a, b, middle), motion.position(middle), strict=True)
        errors.append(max(abs(one - other) for one, other in between))
    return max(errors)


@examples(20)
@given(st.floats(-1.0, 1.0), st.floats(0.5, 60.0))
def test_between_points_the_motion_is_the_decided_one(way: float, duration: float) -> None:
    motion = motion_of(way, duration)
    assert greatest_error(motion, decided_points(motion)) < 1e-6


def test_so_it_is_on_the_path_of_a_tool_that_moves_in_a_straight_line() -> None:
    model = read_robot("franka_fr3")
    robot = StandingRobot(model, (0.0, 0.0, 0.0))
    target = ActionParameters({"target": (0.4, 0.3, 0.4), "yaw": 0.0, "speed": 0.05})
    plan = plan_move_tool(robot, target, None).plan
    assert isinstance(plan, Trajectory)
    motion = StreamedMotion(plan.joint_paths[0], plan.duration, ACCELERATION, JERK)
    assert plan.duration > 4.0
    assert greatest_error(motion, decided_points(motion)) < 1e-6


def test_times_increase_and_both_ends_rest() -> None:
    points = decided_points(motion_of(0.3, 61.0))
    assert all(b.time > a.time for a, b in pairwise(points))
    assert len(points) == 201
    assert points[0].dq == pytest.approx((0.0,) * 7, abs=1e-6)
    assert points[-1].dq == points[-1].ddq == (0.0,) * 7


def test_braking_begins_at_the_speed_of_the_motion_and_ends_at_rest() -> None:
    motion = motion_of(0.4, 2.0)
    points = braking_points(motion, 0.9)
    assert points[0].time == 0.9
    assert points[0].q == pytest.approx(motion.position(0.9))
    speed = (motion.position(0.91)[0] - motion.position(0.89)[0]) / 0.02
    assert points[0].dq == pytest.approx((speed,) * 7, rel=1e-3)
    assert points[-1].time == pytest.approx(0.9 + motion.braking_time)
    assert points[-1].dq == (0.0,) * 7
    assert points[-1].q[0] < motion.position(2.0)[0]


def test_no_joint_brakes_harder_than_its_limit() -> None:
    for point in braking_points(motion_of(0.6, 1.5), 0.75):
        assert max(map(abs, point.ddq)) <= ACCELERATION[0]
