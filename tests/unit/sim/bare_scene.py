"""An empty table as a scene with physics that tests add their own things to."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from aeros.sim.engine.engine import Engine, PlacedBody
from aeros.sim.engine.robot import PhysicalRobot
from aeros.sim.geometry import Camera
from aeros.sim.layouts.coating import CoatingMap
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.robot import RobotOptions
from tests.unit.sim.bullet.bullet_parts import as_bullet
from tests.unit.sim.robot.panda import PANDA


class BareScene:
    """Scene of the Panda on an empty table."""

    robot = RobotOptions(PANDA)
    view = Camera(eye=(1.3, 0.9, 0.8), target=(0.4, 0.0, 0.2))
    pushable_objects: tuple[str, ...] = ()
    cameras: tuple[str, ...] = ()
    initial_cameras: tuple[str, ...] = ()

    def build(self, engine: Engine, robot: PhysicalRobot, chance: RandomSource) -> None:
        """Implement `PhysicalScene.build`: the table."""
        as_bullet(engine.world).bodies.add_box((1.4, 1.6, 0.05), (0.4, 0.0, -0.025))

    def tick(self) -> None:
        """Implement `PhysicalScene.tick`: nothing changes."""

    def measure(self) -> Mapping[str, Any]:
        """Implement `PhysicalScene.measure`: nothing but the robot is measured."""
        return {}

    def body(self, name: str) -> int:
        """Implement `PhysicalScene.body`: there are no objects.

        Raises:
            KeyError: always, as there are no objects.
        """
        raise KeyError(name)

    def placed_bodies(self) -> Mapping[str, PlacedBody]:
        """Implement `PhysicalScene.placed_bodies`: there are none."""
        return {}

    def coatings(self) -> Mapping[str, CoatingMap]:
        """Implement `PhysicalScene.coatings`: there are none."""
        return {}

    def camera(self, name: str) -> Camera:
        """Implement `PhysicalScene.camera`: there is none.

        Raises:
            KeyError: always, as there is no camera.
        """
        raise KeyError(name)

    def believed_camera(self, name: str) -> Camera:
        """Implement `PhysicalScene.believed_camera`: there is none.

        Raises:
            KeyError: always, as there is no camera.
        """
        raise KeyError(name)

    def truth(self) -> Mapping[str, bool]:
        """Implement `PhysicalScene.truth`: nothing is defined."""
        return {}
