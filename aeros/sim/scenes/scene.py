"""What a scene is: things in a world, and what sensors measure of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol

from aeros.sim.bullet.panda import Panda
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.detected_object import DetectedObject
from aeros.sim.geometry import Camera
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.robot import RobotOptions

OptionalDetection = DetectedObject | None
"""What a picture shows of what is looked for; None when it does not."""

DetectionFilter = Callable[[OptionalDetection], OptionalDetection]
"""What everything that a picture shows passes through before anyone hears of it."""


def unfiltered(found: OptionalDetection) -> OptionalDetection:
    """The evaluation of a camera that works."""
    return found


class Scene(Protocol):
    """One task's surroundings.

    robot: how the robot is built for it.
    view: the camera films are taken with.
    things: names of what lies about and can be pushed.
    cameras: those that `detect` knows.
    watching: those of them that have taken a picture when the clock starts.
    """

    robot: RobotOptions
    view: Camera
    pushable_objects: tuple[str, ...]
    cameras: tuple[str, ...]
    initial_cameras: tuple[str, ...]

    def build(self, world: PhysicsWorld, robot: Panda, random: RandomSource) -> None:
        """Put the things into `world`, where `random` wants them; called once, before the first tick."""

    def tick(self) -> None:
        """Note what happened in the last tick: dwell times, peak forces, modelled changes of material."""

    def measure(self) -> Mapping[str, Any]:
        """What is surveyed, felt and counted now, by vocabulary name, SI; what cameras show is `detect`'s."""

    def body(self, name: str) -> int:
        """The body of one of `pushable_objects`; raises KeyError for a thing that is not there."""

    def detect(self, camera: str, through: DetectionFilter = unfiltered) -> Mapping[str, Any]:
        """What `camera` detects now, by vocabulary name."""
