"""A world in which nothing goes wrong: the hooks that a plant offers to what makes things go wrong."""

from __future__ import annotations

from typing import NamedTuple

from aeros.sim.panda import Panda
from aeros.sim.people import People
from aeros.sim.scenes.scene import Scene, Through, as_it_is
from aeros.sim.sensing import Sensors
from aeros.sim.world import World


class Stage(NamedTuple):
    """What a plant is made of."""

    world: World
    robot: Panda
    scene: Scene
    sensors: Sensors
    people: People


class Undisturbed:
    """What a plant calls at each of its hooks; every one does nothing."""

    def attach(self, stage: Stage) -> None:
        """Hear of the plant's own parts, once, when its clock stands at 0."""

    def before_tick(self) -> None:
        """Act on the world after the motors are set and before it steps."""

    def looking(self, camera: str) -> Through:
        """What comes of everything in the picture that `camera` takes now."""
        return as_it_is

    def skill_began(self, skill: str) -> None:
        """Hear that `MODULE.SKILL` begins."""

    def skill_ended(self, skill: str) -> None:
        """Hear that `MODULE.SKILL` has ended."""
