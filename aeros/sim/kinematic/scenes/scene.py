"""The port of scenes without physics: objects laid out at random and the measurements of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

from aeros.sim.kinematic.objects import ObjectSet
from aeros.sim.pictures.late_picture import LatePicture
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.robot import RobotOptions, RobotState
from aeros.sim.scanners.sections import Section


class KinematicScene(Protocol):
    """Surroundings of one task.

    Attributes:
        robot: options to build the robot with.
        cameras: names of the cameras that `see` knows.
        initial_cameras: those that have taken a picture when the clock starts.
    """

    robot: RobotOptions
    cameras: tuple[str, ...]
    initial_cameras: tuple[str, ...]

    def build(self, random: RandomSource) -> ObjectSet:
        """Lay out the scene's objects; called once, before the first tick.

        Args:
            random: random source of the layout.

        Returns:
            The objects, in W.
        """

    def tick(self, state: RobotState) -> None:
        """Update after a tick.

        Args:
            state: the robot's latest readings.
        """

    def measure(self) -> Mapping[str, Any]:
        """Measure surveyed places and instruments.

        Returns:
            Values by name of the state variable, SI, positions in W.
        """

    def place_robot(self, state: RobotState) -> None:
        """Note where the robot is before the first tick, for conditions and surveyed places.

        Args:
            state: of the robot.
        """

    def truth(self) -> Mapping[str, int]:
        """Judge the goals by what is true in the world; nothing that acts may see it.

        Returns:
            The truth, or the number, of each state variable that the scene defines.
        """

    def sections(self, height: float) -> Sequence[Section]:
        """Cut the bodies with a level plane.

        Args:
            height: of the plane in W, m.

        Returns:
            Their sections; the same object as long as none that the plane may meet has moved.
        """

    def see(self, camera: str, state: RobotState, yaw: float, time: float) -> LatePicture:
        """Take a picture.

        Args:
            camera: one of `cameras`.
            state: the robot's latest readings.
            yaw: heading of the tool in W, rad.
            time: now, s.

        Returns:
            The picture of this moment.
        """
