"""A robot that PyBullet ships, and one that is made of hulls and masses, are the same chain."""

from __future__ import annotations

from dataclasses import replace

import pytest

from aeros.sim.bullet.client import bullet
from aeros.sim.bullet.robot import BulletRobot
from aeros.sim.bullet.robot_urdf import load_robot_body
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.robot.model import RobotModel
from aeros.sim.robot.robot import RobotOptions
from tests.unit.sim.robot.panda import PANDA, ZEROS, with_zeros

MADE = replace(PANDA, stock_urdf=None)

pytestmark = pytest.mark.physics


@pytest.mark.parametrize("model", [PANDA, MADE], ids=["stock", "made"])
@pytest.mark.parametrize("carriage", [False, True])
def test_every_link_of_the_hulls_is_there(model: RobotModel, carriage: bool) -> None:
    world = PhysicsWorld()
    loaded = load_robot_body(RobotOptions(model, carriage=carriage), world.client)
    assert loaded.links.keys() == {hull.link for hull in model.body.hulls}
    assert len(loaded.arm) == 7
    assert len(loaded.carriage) == (2 if carriage else 0)
    world.close()


def tool_of(model: RobotModel) -> tuple[float, ...]:
    world = PhysicsWorld()
    robot = BulletRobot(world, RobotOptions(model))
    for _ in range(60):
        world.step()
    state = robot.read_sensors()
    world.close()
    return (*state.tool_position, *state.q)


def test_the_made_robot_holds_itself_where_the_stock_one_does() -> None:
    assert tool_of(MADE) == pytest.approx(tool_of(PANDA), abs=1e-3)


def test_the_made_robot_weighs_what_its_file_says() -> None:
    world = PhysicsWorld()
    loaded = load_robot_body(RobotOptions(MADE), world.client)
    masses = [
        bullet.getDynamicsInfo(loaded.number, joint, physicsClientId=world.client)[0] for joint in loaded.arm
    ]
    assert masses == pytest.approx([link.mass for link in PANDA.dynamics.links])
    world.close()


def test_a_robot_whose_joints_count_from_elsewhere_holds_itself_at_the_same_place() -> None:
    x, y, z, *q = tool_of(with_zeros(PANDA))
    turned = [one + zero for one, zero in zip(q, ZEROS, strict=True)]
    assert (x, y, z, *turned) == pytest.approx(tool_of(MADE), abs=1e-4)
