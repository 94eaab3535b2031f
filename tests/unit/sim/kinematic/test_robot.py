"""The robot at its set points: fingers, loads, speeds, and a base that carries the arm."""

from __future__ import annotations

from math import hypot, pi

import numpy as np
import pytest

from aeros.sim.clock import TICK
from aeros.sim.geometry import Pose, yaw_orientation
from aeros.sim.kinematic.objects import GraspableObject, ObjectSet, slab
from aeros.sim.kinematic.robot import BLOCKING_FORCE, KinematicRobot
from aeros.sim.kinematic.tool_kinematics import tool_kinematics
from aeros.sim.robot.robot import RobotOptions
from tests.unit.sim.robot.panda import FINGER_GAP_MAX, FINGER_SPEED, PANDA

Q = np.array([0.0, -0.4, 0.0, -1.9, 0.0, 1.5, pi / 4])
STILL = np.zeros(7)
TOOL = tool_kinematics(PANDA, Q.tolist())
STEP = 2.0 * FINGER_SPEED * TICK


def robot(
    *things: GraspableObject, top: float = -9.0, base: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> KinematicRobot:
    """Its hand points down over a table of this height."""
    made = KinematicRobot(
        RobotOptions(PANDA, base=base, carriage=True), ObjectSet(things, [slab(0.0, 0.0, top, 9.0, 9.0)])
    )
    made.command(Q, STILL)
    made.tick()
    return made


def cube_in_hand(width: float = 0.04) -> GraspableObject:
    x, y, z = TOOL.position
    half = width / 2.0
    return GraspableObject(Pose((x, y, z), yaw_orientation(0.0)), (-half,) * 3, (half,) * 3, half)


def test_a_set_point_is_reached_in_the_next_tick() -> None:
    made = robot()
    q = Q + 0.1
    made.command(q, STILL + 0.5)
    assert made.read_sensors().q == tuple(Q.tolist())
    made.tick()
    state = made.read_sensors()
    assert (state.q, state.qd) == (tuple(q.tolist()), (0.5,) * 7)
    assert state.tool_position == pytest.approx(tool_kinematics(PANDA, q.tolist()).position)


def test_the_base_carries_the_arm() -> None:
    made = robot(base=(1.0, 2.0, 0.5))
    x, y, z = TOOL.position
    assert made.read_sensors().tool_position == pytest.approx((x + 1.0, y + 2.0, z + 0.5))
    made.command_base(np.array([0.25, -0.5]), np.array([0.3, -0.4]))
    made.tick()
    state = made.read_sensors()
    assert state.base_position == pytest.approx((1.25, 1.5, 0.5))
    assert state.base_velocity == pytest.approx((0.3, -0.4, 0.0))
    assert state.tool_position == pytest.approx((x + 1.25, y + 1.5, z + 0.5))
    assert state.tool_speed == pytest.approx(0.5)


def test_the_speed_of_the_tool_is_that_of_joints_and_base_together() -> None:
    made = robot()
    rates = np.zeros(7)
    rates[0] = 0.5
    made.command(Q, rates)
    made.tick()
    x, y, _ = TOOL.position
    assert made.read_sensors().tool_speed == pytest.approx(0.5 * hypot(x, y))
    made.command_base(np.zeros(2), np.array([0.0, -0.5 * x]))
    made.tick()
    assert made.read_sensors().tool_speed == pytest.approx(0.0, abs=1e-9)


def test_fingers_close_and_open_at_their_speed_up_to_the_asked_width() -> None:
    made = robot()
    made.grip(FINGER_GAP_MAX - 2.5 * STEP, 10.0)
    gaps, speeds = [], []
    for _ in range(4):
        made.tick()
        gaps.append(made.read_sensors().finger_gap)
        speeds.append(made.read_sensors().finger_speed)
    assert gaps == pytest.approx([FINGER_GAP_MAX - n * STEP for n in (1, 2, 2.5, 2.5)])
    assert speeds == pytest.approx([FINGER_SPEED, FINGER_SPEED, FINGER_SPEED / 2.0, 0.0])
    made.grip(FINGER_GAP_MAX - STEP, 10.0)
    made.tick()
    assert made.read_sensors().finger_gap == pytest.approx(FINGER_GAP_MAX - 1.5 * STEP)
    made.tick()
    assert made.read_sensors().finger_gap == pytest.approx(FINGER_GAP_MAX - STEP)


def test_fingers_stop_at_what_is_between_them_and_hold_it_by_the_asked_force() -> None:
    made = robot(cube_in_hand())
    # Where the cube was laid out there is no table: it fell, so lay it into the hand again.
    thing = made._things._things[0]
    thing.pose = Pose(TOOL.position, yaw_orientation(0.0))
    made.grip(0.0, 12.0)
    for _ in range(200):
        made.tick()
    assert made.read_sensors().finger_gap == pytest.approx(0.04)
    assert made.finger_forces() == (12.0, 12.0)
    assert made.is_holding()
    made.grip(FINGER_GAP_MAX, 12.0)
    made.tick()
    assert made.finger_forces() == (0.0, 0.0)
    assert not made.is_holding()


def test_an_object_wider_than_the_gap_is_not_gripped() -> None:
    made = robot(cube_in_hand(0.06))
    made.grip(0.05, 12.0)
    for _ in range(200):
        made.tick()
    made._things._things[0].pose = Pose(TOOL.position, yaw_orientation(0.0))
    made.grip(0.0, 12.0)
    for _ in range(400):
        made.tick()
    assert made.read_sensors().finger_gap == pytest.approx(0.0)
    assert made.finger_forces() == (0.0, 0.0)


def test_a_pressed_hand_feels_its_load_in_its_joints() -> None:
    # The tips, 9 mm below the tool, are 1 mm deep in the table: 10 N.
    made = robot(top=TOOL.position[2] - 0.009 + 0.001)
    assert made.contact_force() == made.wrist_vertical_force() == pytest.approx(10.0)
    expected = [10.0 * column[2] for column in TOOL.jacobian]
    assert made.read_sensors().torque == pytest.approx(expected)
    assert robot().contact_force() == 0.0


def test_a_blocked_hand_follows_no_speed() -> None:
    rates = np.full(7, 0.25)
    for depth, is_followed in ((0.0099, True), (0.0101, False)):
        made = robot(top=TOOL.position[2] - 0.009 + depth if depth < 0.005 else -9.0)
        made._things.load = depth * 10_000.0
        made.command(Q, rates)
        q, qd = made.followed_set_points()
        assert q.tolist() == Q.tolist()
        assert qd.tolist() == (rates if is_followed else STILL).tolist()
    assert BLOCKING_FORCE == 100.0


def test_the_carriage_follows_its_set_points() -> None:
    made = robot()
    made.command_base(np.array([0.25, -0.5]), np.array([0.3, -0.4]))
    xy, speed = made.followed_base_set_points()
    assert (xy.tolist(), speed.tolist()) == ([0.25, -0.5], [0.3, -0.4])
