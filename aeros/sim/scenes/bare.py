"""An empty table, for trying motions."""

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
    """Scene of the Panda on an empty table."""

    robot = RobotOptions()
    view = Camera(eye=(1.3, 0.9, 0.8), target=(0.4, 0.0, 0.2))
    pushable_objects: tuple[str, ...] = ()
    cameras: tuple[str, ...] = ()
    initial_cameras: tuple[str, ...] = ()

    def build(self, world: PhysicsWorld, robot: Panda, chance: RandomSource) -> None:
        """Implement `Scene.build`: the table."""
        add_table(world)

    def tick(self) -> None:
        """Implement `Scene.tick`: nothing changes."""

    def measure(self) -> Mapping[str, Any]:
        """Implement `Scene.measure`: nothing but the robot is measured."""
        return {}

    def body(self, name: str) -> int:
        """Implement `Scene.body`: there are no objects.

        Raises:
            KeyError: always, as there are no objects.
        """
        raise KeyError(name)

    def camera(self, name: str) -> Camera:
        """Implement `Scene.camera`: there is none.

        Raises:
            KeyError: always, as there is no camera.
        """
        raise KeyError(name)

    def detect(self, camera: str, through: DetectionFilter = unfiltered) -> Mapping[str, Any]:
        """Implement `Scene.detect`: there is no camera.

        Raises:
            KeyError: always, as there is no camera.
        """
        raise KeyError(camera)
