"""What a scene is without physics: things laid out by chance, and what is measured of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from aeros.sim.kinematic.objects import ObjectSet
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.robot import RobotOptions, RobotState


class KinematicScene(Protocol):
    """One task's surroundings.

    robot: how the robot is built for it.
    cameras: those that `detect` knows.
    watching: those of them that have taken a picture when the clock starts.
    """

    robot: RobotOptions
    cameras: tuple[str, ...]
    initial_cameras: tuple[str, ...]

    def build(self, random: RandomSource) -> ObjectSet:
        """The things, where `random` wants them; called once, before the first tick."""

    def tick(self) -> None:
        """Note what happened in the last tick."""

    def measure(self, state: RobotState, time: float) -> Mapping[str, Any]:
        """Poses and predicates by vocabulary name, SI, measured now."""

    def detect(self, camera: str, state: RobotState, yaw: float, time: float) -> Mapping[str, Any]:
        """What `camera` detects now, the tool at `yaw`, by vocabulary name."""
