"""An empty table, without physics."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from aeros.sim.kinematic.objects import ObjectSet, Surface, slab
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.robot import RobotOptions, RobotState

TABLE: Final[Surface] = slab(0.4, 0.0, 0.0, 1.4, 1.6)
"""The table's top (`aeros/sim/scenes/furniture.py`)."""


class KinematicBareScene:
    """Scene of the Panda on an empty table."""

    robot = RobotOptions()
    cameras: tuple[str, ...] = ()
    initial_cameras: tuple[str, ...] = ()

    def build(self, chance: RandomSource) -> ObjectSet:
        """Implement `KinematicScene.build`: the table."""
        return ObjectSet((), (TABLE,))

    def tick(self) -> None:
        """Implement `KinematicScene.tick`: nothing changes."""

    def measure(self, state: RobotState, time: float) -> Mapping[str, Any]:
        """Implement `KinematicScene.measure`: nothing but the robot is measured."""
        return {}

    def detect(self, camera: str, state: RobotState, yaw: float, time: float) -> Mapping[str, Any]:
        """Implement `KinematicScene.detect`: there is no camera.

        Raises:
            KeyError: always, as there is no camera.
        """
        raise KeyError(camera)
