"""Sections of everything that the scanners of a cell can meet in a world with physics."""

from __future__ import annotations

from collections.abc import Sequence

from aeros.sim.engine.engine import Engine
from aeros.sim.engine.people import People
from aeros.sim.engine.robot import PhysicalRobot
from aeros.sim.geometry import Vector3
from aeros.sim.scanners.sections import Section


class PhysicsCell:
    """Sections of the bodies, the people and the robot of a world. It implements `ScannedCell`.

    Args:
        engine: the engine with the world.
        robot: the robot in it.
        people: the people in it.
        height: of the scan plane in W, m.
    """

    def __init__(self, engine: Engine, robot: PhysicalRobot, people: People, height: float) -> None:
        self._robot = robot
        self._people = people
        self._height = height
        self._bodies = engine.cut_bodies(height, lambda: [robot.body, *people.bodies])

    def furniture(self) -> Sequence[Section]:
        """Implement `ScannedCell.furniture`."""
        return self._bodies.sections()

    def people(self) -> Sequence[Section]:
        """Implement `ScannedCell.people`."""
        return self._people.sections(self._height)

    def robot(self) -> tuple[Sequence[float], Vector3]:
        """Implement `ScannedCell.robot`."""
        base, _ = self._robot.true_points()
        return self._robot.read_sensors().q, base
