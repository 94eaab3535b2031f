"""What a scene is: things in a world, and what sensors measure of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol

from aeros.sim.bullet.panda import Panda
from aeros.sim.bullet.world import World
from aeros.sim.detected_object import Sight
from aeros.sim.geometry import Camera
from aeros.sim.randomness import Chance
from aeros.sim.robot.robot import RobotOptions

Detected = Sight | None
"""What a picture shows of what is looked for; None when it does not."""

Through = Callable[[Detected], Detected]
"""What everything that a picture shows passes through before anyone hears of it."""


def as_it_is(found: Detected) -> Detected:
    """The evaluation of a camera that works."""
    return found


class Scene(Protocol):
    """One task's surroundings.

    robot: how the robot is built for it.
    view: the camera films are taken with.
    things: names of what lies about and can be pushed.
    cameras: those that `look` knows.
    watching: those of them that have taken a picture when the clock starts.
    """

    robot: RobotOptions
    view: Camera
    things: tuple[str, ...]
    cameras: tuple[str, ...]
    watching: tuple[str, ...]

    def build(self, world: World, robot: Panda, chance: Chance) -> None:
        """Put the things into `world`, where `chance` wants them; called once, before the first tick."""

    def tick(self) -> None:
        """Note what happened in the last tick: dwell times, peak forces, modelled changes of material."""

    def measure(self) -> Mapping[str, Any]:
        """What is surveyed, felt and counted now, by vocabulary name, SI; what cameras show is `look`'s."""

    def thing(self, name: str) -> int:
        """The body of one of `things`; raises KeyError for a thing that is not there."""

    def look(self, camera: str, through: Through = as_it_is) -> Mapping[str, Any]:
        """What `camera` detects now, by vocabulary name."""
