"""A table and nothing on it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from aeros.sim.bullet.panda import Panda
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.geometry import Camera
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.robot import RobotOptions
from aeros.sim.scenes.furniture import add_table
from aeros.sim.scenes.scene import DetectionFilter, unfiltered


class BareScene:
    """The Panda on its table: for trying motions."""

    robot = RobotOptions()
    view = Camera(eye=(1.3, 0.9, 0.8), target=(0.4, 0.0, 0.2))
    pushable_objects: tuple[str, ...] = ()
    cameras: tuple[str, ...] = ()
    initial_cameras: tuple[str, ...] = ()

    def build(self, world: PhysicsWorld, robot: Panda, chance: RandomSource) -> None:
        """Add the table."""
        add_table(world)

    def tick(self) -> None:
        """Nothing changes."""

    def measure(self) -> Mapping[str, Any]:
        """Nothing is measured but the robot."""
        return {}

    def body(self, name: str) -> int:
        """Nothing lies about."""
        raise KeyError(name)

    def detect(self, camera: str, through: DetectionFilter = unfiltered) -> Mapping[str, Any]:
        """There is no camera."""
        raise KeyError(camera)
