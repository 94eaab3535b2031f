"""Sections of everything that the scanners of a cell can meet in a scene without physics."""

from __future__ import annotations

from collections.abc import Sequence

from aeros.sim.geometry import Vector3
from aeros.sim.kinematic.robot import KinematicRobot
from aeros.sim.kinematic.scenes.scene import KinematicScene
from aeros.sim.scanners.sections import Section


class KinematicCell:
    """Bodies and robot of a scene. It implements `ScannedCell`; nobody is there.

    Args:
        scene: the scene, built.
        robot: the robot in it.
        height: of the scan plane in W, m.
    """

    def __init__(self, scene: KinematicScene, robot: KinematicRobot, height: float) -> None:
        self._scene = scene
        self._robot = robot
        self._height = height

    def furniture(self) -> Sequence[Section]:
        """Implement `ScannedCell.furniture`."""
        return self._scene.sections(self._height)

    def people(self) -> Sequence[Section]:
        """Implement `ScannedCell.people`: this plant has none."""
        return ()

    def robot(self) -> tuple[Sequence[float], Vector3]:
        """Implement `ScannedCell.robot`: its odometry is exact."""
        state = self._robot.read_sensors()
        return state.q, state.base_position
