"""Motors stay inside their limits, and push on an obstacle no harder than their corrections allow."""

from __future__ import annotations

import numpy as np
import pytest

from aeros.sim.mujoco.drives import MujocoDrives
from aeros.sim.mujoco.engine import MujocoEngine
from aeros.sim.mujoco.robot import MujocoRobot
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.odometry import WheelOdometry
from aeros.sim.robot.robot import RobotOptions
from tests.unit.sim.engine.engines import GREY
from tests.unit.sim.robot.panda import PANDA, READY_POSTURE, TAU_MAX

Arm = tuple[MujocoEngine, MujocoRobot, MujocoDrives]

pytestmark = pytest.mark.physics


@pytest.fixture
def arm() -> Arm:
    engine = MujocoEngine()
    robot = engine.add_robot(RobotOptions(PANDA), WheelOdometry(RandomSource(0)))
    return engine, robot, robot._drives


def swing(engine: MujocoEngine, robot: MujocoRobot, rate: float, ticks: int) -> None:
    """Turn the first joint, evenly after a tenth of a second."""
    q = robot.q_command
    for tick in range(1, ticks + 1):
        speed = np.array([rate * min(1.0, tick / 24), *(0.0,) * 6])
        q = q + speed / 240
        robot.command(q, speed)
        engine.world.step()


def test_a_joint_follows_its_set_points_without_lag(
    arm: Arm,
) -> None:
    engine, robot, drives = arm
    swing(engine, robot, 1.0, 120)
    assert drives.positions[0] == pytest.approx(float(robot.q_command[0]), abs=1e-3)
    assert drives.rates[0] == pytest.approx(1.0, abs=0.01)
    assert np.abs(drives.external).max() < 0.5
    assert robot.contact_force() == 0.0


def test_at_rest_motors_hold_the_weight(arm: Arm) -> None:
    engine, robot, drives = arm
    for _ in range(24):
        engine.world.step()
    assert drives.efforts[3] == pytest.approx(22.0, abs=0.1)
    assert drives.efforts[:7] == robot.read_sensors().torque


def test_an_obstacle_meets_the_correction_alone(arm: Arm) -> None:
    engine, robot, drives = arm
    x, y, z = robot.read_sensors().tool_position
    post = engine.add_box((1.0, 0.1, 0.4), (x, y + 0.16, z), mass=0.0, colour=GREY)
    at_rest = drives.efforts[0]
    swing(engine, robot, 0.5, 360)
    assert engine.world.contacts(post, robot.body)
    assert abs(drives.efforts[0] - at_rest) <= PANDA.servos.correction[0] + 1.0
    assert 5.0 < robot.contact_force() < 150.0
    assert float(robot.q_command[0]) - drives.positions[0] > 0.05


def test_a_weaker_motor_gives_no_more_than_it_can(
    arm: Arm,
) -> None:
    engine, robot, drives = arm
    robot.torque_limits[3] = 5.0
    for _ in range(24):
        robot.hold_arm()
        engine.world.step()
    assert drives.efforts[3] == pytest.approx(5.0)
    assert (
        robot.read_sensors().q[3] < READY_POSTURE[3] - 0.01
        or robot.read_sensors().q[3] > READY_POSTURE[3] + 0.01
    )
    assert all(abs(one) <= most for one, most in zip(drives.efforts[:7], TAU_MAX.tolist(), strict=True))


def test_fingers_go_at_their_greatest_speed_and_no_faster(
    arm: Arm,
) -> None:
    engine, robot, drives = arm
    robot.grip(0.0, 40.0)
    speeds = []
    for _ in range(240):
        engine.world.step()
        speeds.append(robot.read_sensors().finger_speed)
    assert 0.045 < max(speeds) < 0.06
    assert robot.read_sensors().finger_gap < 1e-3
    assert not robot.is_holding()
    assert max(drives.efforts[-2:]) < 2.0
