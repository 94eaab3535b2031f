"""The simulated scanners of a cell: rays that meet what is true, with noise, losses and faults."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from aeros.sim.geometry import Vector3
from aeros.sim.pictures.scene_solids import robot_solids
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.model import RobotModel
from aeros.sim.robot.robot import CARRIAGE_EDGES
from aeros.sim.scanners.ray_fan import Array, ray_fan
from aeros.sim.scanners.sections import Section, cast, cut, rectangle
from aeros.spec.model.sensor_errors import AreaScanners

_BLOCK: Final = 16
"""Scans whose noise is drawn at once, as generators are slow to make."""

_TAUGHT_SCANS: Final = 100
"""Scans of which the survey of the empty cell is the mean; chosen."""


class ScannerSet:
    """Scanners that scan at the same moments.

    Args:
        scanners: the scanners.
        chance: random source of noise and losses.
        robot: the robot.
        carriage: it stands on its carriage.

    Attributes:
        covered: share of a scanner's window that is dirty or covered, from its middle, by the scanner's name.
        silent: names of scanners that send nothing.
    """

    def __init__(
        self, scanners: AreaScanners, chance: RandomSource, robot: RobotModel, *, carriage: bool
    ) -> None:
        self._model = robot
        self._scanners = scanners
        self._plane = scanners.floor + scanners.height
        self._fan = ray_fan(scanners)
        self._free = np.full(len(self._fan.origins), scanners.range)
        self._chance = chance
        self._carriage = carriage
        self._background: tuple[Sequence[Section], Array] = ((), self._free)
        self._noise: tuple[int, Array] = (-1, self._free)
        self._losses: tuple[int, Array] = (-1, self._free)
        self.covered: Mapping[str, float] = {}
        self.silent: frozenset[str] = frozenset()

    def teach(self, furniture: Sequence[Section]) -> Array:
        """Survey the cell while neither the robot nor a person is in it.

        Args:
            furniture: sections of what stands there.

        Returns:
            Length of each ray (n,), m.
        """
        true = self._see(furniture)
        draw = self._chance.generator("scanner survey").standard_normal(len(true))
        noisy = true + self._scanners.noise / _TAUGHT_SCANS**0.5 * draw
        taught: Array = np.where(true < self._scanners.range, noisy, true)
        return taught

    def loses(self, number: int) -> bool:
        """Say if one of the scanners sends nothing of a scan.

        Args:
            number: of the scan.

        Returns:
            True if the scan is not whole.
        """
        block, place = divmod(number, _BLOCK)
        if self._losses[0] != block:
            draw = self._chance.generator("scanner losses", block)
            self._losses = (block, draw.random((_BLOCK, len(self._scanners.scanners))))
        return bool(self.silent) or bool((self._losses[1][place] < self._scanners.dropout).any())

    def scan(
        self,
        number: int,
        furniture: Sequence[Section],
        people: Sequence[Section],
        joints: Sequence[float],
        base: Vector3,
    ) -> Array:
        """Scan once.

        Args:
            number: of the scan.
            furniture: sections of what stands in the cell; the same object if nothing there has moved.
            people: sections of people.
            joints: true joint positions of the robot (7), rad; none if its arm does not reach the plane.
            base: true position of the arm's base, m.

        Returns:
            Measured length of each ray (n,), m, at most the scanners' range.
        """
        true = cast(self._fan, self._see(furniture), [*people, *self._robot(joints, base)])
        seen = np.clip(true + self._scanners.noise * self._noise_of(number), 0.0, self._scanners.range)
        ranges: Array = np.where(true < self._scanners.range, seen, self._scanners.range)
        for place, one in enumerate(self._scanners.scanners):
            share = self.covered.get(one.name, 0.0)
            if share > 0.0:
                rays, count = self._fan.rays_of(place), round(share * self._fan.per_scanner)
                first = rays.start + (self._fan.per_scanner - count) // 2
                ranges[first : first + max(1, count)] = 0.0
        return ranges

    def _see(self, furniture: Sequence[Section]) -> Array:
        if self._background[0] is not furniture:
            self._background = (furniture, cast(self._fan, self._free, furniture))
        return self._background[1]

    def _robot(self, joints: Sequence[float], base: Vector3) -> list[Section]:
        x, y, z = base
        length, width, height = CARRIAGE_EDGES
        sections: list[Section] = []
        if self._carriage and z - height < self._plane < z:
            sections.append(rectangle((x - length / 2, y - width / 2), (x + length / 2, y + width / 2)))
        if joints:
            links = (cut(one, self._plane) for one in robot_solids(self._model, joints, base))
            sections.extend(one for one in links if one is not None)
        return sections

    def _noise_of(self, number: int) -> Array:
        block, place = divmod(number, _BLOCK)
        if self._noise[0] != block:
            draw = self._chance.generator("scanner noise", block)
            self._noise = (block, draw.standard_normal((_BLOCK, len(self._free))))
        noise: Array = self._noise[1][place]
        return noise
