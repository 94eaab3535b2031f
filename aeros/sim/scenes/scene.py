"""What a scene is: things in a world, and what sensors measure of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from aeros.sim.geometry import Camera
from aeros.sim.panda import Panda
from aeros.sim.randomness import Chance
from aeros.sim.robot import RobotOptions
from aeros.sim.world import World


class Scene(Protocol):
    """One task's surroundings.

    robot: how the robot is built for it.
    view: the camera films are taken with.
    cameras: those that `look` knows.
    """

    robot: RobotOptions
    view: Camera
    cameras: tuple[str, ...]

    def build(self, world: World, robot: Panda, chance: Chance) -> None:
        """Put the things into `world`, where `chance` wants them; called once, before the first tick."""

    def tick(self) -> None:
        """Note what happened in the last tick: dwell times, peak forces, modelled changes of material."""

    def measure(self) -> Mapping[str, Any]:
        """Poses and predicates by vocabulary name, SI, measured from poses and contacts now."""

    def look(self, camera: str) -> Mapping[str, Any]:
        """What `camera` detects now, by vocabulary name."""
