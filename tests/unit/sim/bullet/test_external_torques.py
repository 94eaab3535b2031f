"""External torques against pushes of a stated force, and in free motion."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from aeros.sim.bullet.client import bullet
from aeros.sim.bullet.robot import BulletRobot
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.clock import TICK
from aeros.sim.kinematic.tool_kinematics import tool_kinematics
from aeros.sim.robot.robot import RobotOptions
from tests.unit.sim.robot.panda import PANDA

pytestmark = pytest.mark.physics


@pytest.fixture
def world() -> Iterator[PhysicsWorld]:
    made = PhysicsWorld()
    yield made
    made.close()


def test_a_push_at_the_tool_is_its_torques_by_the_jacobian_and_its_force(world: PhysicsWorld) -> None:
    one = BulletRobot(world, RobotOptions(PANDA))
    force = (10.0, -20.0, 15.0)
    for _ in range(60):
        place = one.read_sensors().tool_position
        bullet.applyExternalForce(
            one.body, one._tool, force, place, bullet.WORLD_FRAME, physicsClientId=world.client
        )
        world.step()
    jacobian = np.array(tool_kinematics(PANDA, one.read_sensors().q).jacobian)
    assert one._external.torques[:7] == pytest.approx(jacobian @ np.array(force), abs=0.2)
    assert one.contact_force() == pytest.approx(float(np.linalg.norm(force)), rel=0.1)
    assert one.net_contact_force() == 0.0  # nothing touches it: only motors show the push


def test_fast_free_motion_is_no_contact(world: PhysicsWorld) -> None:
    one = BulletRobot(world, RobotOptions(PANDA))
    start, most = one.q_command.copy(), 0.0
    for tick in range(480):
        at = tick * TICK
        turn = 0.3 * np.array([1.0, 0.5, -1.0, 0.5, 1.0, -0.5, 1.0])
        one.command(start + turn * np.sin(2.0 * at), 2.0 * turn * np.cos(2.0 * at))
        world.step()
        most = max(most, one.contact_force()) if tick > 24 else 0.0
    assert most == 0.0
    assert 0.001 < max(map(abs, one._external.torques[:7])) < 0.3


def test_the_drives_of_a_carriage_feel_a_push(world: PhysicsWorld) -> None:
    one = BulletRobot(world, RobotOptions(PANDA, carriage=True, base=(0.0, 0.0, 0.3)))
    foot = one._drive[-1]
    for _ in range(60):
        place = world.pose(one.body, foot).position
        bullet.applyExternalForce(
            one.body, foot, (30.0, 40.0, 0.0), place, bullet.WORLD_FRAME, physicsClientId=world.client
        )
        world.step()
    assert one._external.torques[:2] == pytest.approx((30.0, 40.0), abs=1.0)
    assert one.contact_force() == pytest.approx(50.0, abs=2.0)
