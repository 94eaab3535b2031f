"""The robot of every engine: set points are kept, faults do not change them, and drift is not the truth."""

from __future__ import annotations

from math import dist

import numpy as np
import pytest

from aeros.sim.engine.engine import Engine
from aeros.sim.engine.robot import PhysicalRobot
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.odometry import WheelOdometry
from aeros.sim.robot.robot import RobotOptions
from tests.unit.sim.engine.engines import engine
from tests.unit.sim.robot.panda import PANDA, READY_POSTURE

pytestmark = pytest.mark.physics

__all__ = ["engine"]


def add(engine: Engine, *, carriage: bool = False) -> PhysicalRobot:
    return engine.add_robot(RobotOptions(PANDA, carriage=carriage), WheelOdometry(RandomSource(0)))


def test_a_robot_that_holds_does_not_move(engine: Engine) -> None:
    robot = add(engine)
    start = robot.read_sensors()
    assert start.q == pytest.approx(tuple(READY_POSTURE.tolist()))
    assert start.tool_position == pytest.approx((0.30689, 0.0, 0.48688), abs=1e-4)
    for _ in range(60):
        engine.world.step()
    state = robot.read_sensors()
    assert dist(state.q, start.q) < 1e-3
    assert robot.contact_force() == 0.0
    assert robot.net_contact_force() == 0.0
    assert state.finger_gap == pytest.approx(0.08, abs=1e-3)


def test_motors_that_a_fault_sets_do_not_change_the_command(engine: Engine) -> None:
    robot = add(engine)
    away = READY_POSTURE + 0.01
    for _ in range(72):
        robot.set_arm_motors(away, np.zeros(7))
        engine.world.step()
    assert np.array_equal(robot.q_command, READY_POSTURE)
    assert robot.read_sensors().q == pytest.approx(tuple(away.tolist()), abs=3e-3)


def test_drift_of_odometry_is_read_and_is_not_the_truth(engine: Engine) -> None:
    robot = add(engine, carriage=True)
    base, tool = robot.true_points()
    robot.odometry.drift = (0.004, -0.002)
    engine.world.step()
    state = robot.read_sensors()
    assert state.base_position == pytest.approx((0.004, -0.002, 0.0), abs=1e-4)
    assert robot.true_points()[0] == pytest.approx(base, abs=1e-4)
    assert robot.true_points()[1] == pytest.approx(tool, abs=1e-3)
    robot.hold_base()
    for _ in range(120):
        engine.world.step()
    assert robot.read_sensors().base_position[:2] == pytest.approx((0.0, 0.0), abs=1e-3)


def test_fingers_close_as_far_as_commanded_and_then_hold_no_object(engine: Engine) -> None:
    robot = add(engine)
    robot.grip(0.02, 20.0)
    for _ in range(240):
        engine.world.step()
    assert robot.grip_command == (0.02, 20.0)
    assert robot.read_sensors().finger_gap == pytest.approx(0.02, abs=1e-3)
    assert not robot.is_holding()


def test_a_weak_motor_lets_the_arm_sink(engine: Engine) -> None:
    robot = add(engine)
    height = robot.read_sensors().tool_position[2]
    for _ in range(24):
        robot.set_arm_motors(robot.q_command, np.zeros(7), strength=0.1)
        engine.world.step()
    assert robot.read_sensors().tool_position[2] < height - 0.005
