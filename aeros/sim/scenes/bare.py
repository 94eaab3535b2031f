"""A table and nothing on it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from aeros.sim.bullet.panda import Panda
from aeros.sim.bullet.world import World
from aeros.sim.geometry import Camera
from aeros.sim.randomness import Chance
from aeros.sim.robot.robot import RobotOptions
from aeros.sim.scenes.furniture import add_table
from aeros.sim.scenes.scene import Through, as_it_is


class Bare:
    """The Panda on its table: for trying motions."""

    robot = RobotOptions()
    view = Camera(eye=(1.3, 0.9, 0.8), target=(0.4, 0.0, 0.2))
    things: tuple[str, ...] = ()
    cameras: tuple[str, ...] = ()
    watching: tuple[str, ...] = ()

    def build(self, world: World, robot: Panda, chance: Chance) -> None:
        """Add the table."""
        add_table(world)

    def tick(self) -> None:
        """Nothing changes."""

    def measure(self) -> Mapping[str, Any]:
        """Nothing is measured but the robot."""
        return {}

    def thing(self, name: str) -> int:
        """Nothing lies about."""
        raise KeyError(name)

    def look(self, camera: str, through: Through = as_it_is) -> Mapping[str, Any]:
        """There is no camera."""
        raise KeyError(camera)
