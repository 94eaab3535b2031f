"""The parts of a plant on PyBullet, for tests that act on the simulator itself."""

from __future__ import annotations

from aeros.sim.bullet.robot import BulletRobot
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.engine.robot import PhysicalRobot
from aeros.sim.engine.world import EngineWorld


def as_bullet(world: EngineWorld) -> PhysicsWorld:
    """Return a world that is one of PyBullet."""
    assert isinstance(world, PhysicsWorld)
    return world


def as_panda(robot: PhysicalRobot) -> BulletRobot:
    """Return a robot that is one of PyBullet."""
    assert isinstance(robot, BulletRobot)
    return robot
