"""The port of scenes with physics: objects in a world and the measurements of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from aeros.sim.engine.engine import Engine, PlacedBody
from aeros.sim.engine.robot import PhysicalRobot
from aeros.sim.geometry import Camera
from aeros.sim.layouts.coating import CoatingMap
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.robot import RobotOptions


class PhysicalScene(Protocol):
    """Surroundings of one task.

    Attributes:
        robot: options to build the robot with.
        view: camera of films and windows.
        pushable_objects: names of the objects that can be pushed.
        cameras: names of the cameras that `camera` knows.
        initial_cameras: those that have taken a picture when the clock starts.
    """

    robot: RobotOptions
    view: Camera
    pushable_objects: tuple[str, ...]
    cameras: tuple[str, ...]
    initial_cameras: tuple[str, ...]

    def build(self, engine: Engine, robot: PhysicalRobot, chance: RandomSource) -> None:
        """Add the scene's objects to the world; called once, before the first tick.

        Args:
            engine: the engine with the world, in which is only the robot.
            robot: the robot in it.
            chance: random source of the layout.

        Raises:
            UserError: a model cannot be loaded, or two bodies overlap.
        """

    def tick(self) -> None:
        """Update after a tick: dwell times, peak forces, modelled changes of material."""

    def measure(self) -> Mapping[str, Any]:
        """Measure surveyed places and instruments.

        Returns:
            Values by name of the state variable, SI, positions in W.
        """

    def body(self, name: str) -> int:
        """Find the body of an object.

        Args:
            name: one of `pushable_objects`.

        Returns:
            Its number.

        Raises:
            KeyError: there is no such object.
        """

    def placed_bodies(self) -> Mapping[str, PlacedBody]:
        """Return the bodies in the world.

        Returns:
            The bodies by name.
        """

    def coatings(self) -> Mapping[str, CoatingMap]:
        """Return the layers that can be wiped off.

        Returns:
            The layers by name, as they are now.
        """

    def camera(self, name: str) -> Camera:
        """Place a camera where it is now.

        Args:
            name: one of `cameras`.

        Returns:
            The camera, in W.

        Raises:
            KeyError: there is no such camera.
        """

    def believed_camera(self, name: str) -> Camera:
        """Return where the robot takes a camera to be: one that it carries drifts with its odometry.

        Args:
            name: one of `cameras`.

        Returns:
            The camera, in W as the robot takes it to be.

        Raises:
            KeyError: there is no such camera.
        """

    def truth(self) -> Mapping[str, int]:
        """Judge the goals by what is true in the world; nothing that acts may see it.

        Returns:
            The truth, or the number, of each state variable that the scene defines.
        """
