"""Distance of the nearest person from the robot, from what scanners measure.

This is the safety controller's part: it knows the scans, the cell as it was surveyed empty, and the robot's
own joint positions and odometry, and nothing else of the world.

What is nearer to a scanner than in the surveyed cell is the robot itself or an intruder. Two rays side by
side that are shorter have met one; a ray alone may be noise, until the next scan finds one there again. A
place that some scanner saw then and none sees now may hide a person. The distance is that of the nearest
intruder or place, less what the scanner may be wrong by. Nobody knows how tall an intruder is, so distances
are level ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from aeros.sim.geometry import Vector3
from aeros.sim.robot.model import RobotModel
from aeros.sim.scanners.ray_fan import Array, ray_fan
from aeros.sim.scanners.robot_outline import RobotOutline
from aeros.sim.scanners.sight_grid import Indices, SightGrid
from aeros.spec.model.sensor_errors import AreaScanners

NEAR_RANGE: Final = 0.05
"""Least distance that a scanner measures, m: a nearer one is its own window, which is dirty or covered.
Source: SICK, operating instructions of the nanoScan3 I/O, 8024596, section 4.3.2."""

_TRACKING_SHARE: Final = 0.2
"""Share of the carriage's measured displacement that is added from each scan; chosen, as a scan is noisy."""

_PLAY: Final = 3.0
"""Standard deviations of noise by which a distance must rise to count. Of somebody who stands still the
distance falls to its least value and stays there; else a rule at its bound would hold now and again."""

_PERSON_SPEED: Final = 2.0
"""Greatest speed of people, m/s: the greater of the two that ISO 13855 reckons with."""

_SCANS_APART: Final = 2
"""Periods between two scans if the one between was lost; after more losses readings are too old anyway."""

_WIDTH: Final = 2.0
"""Least width that meets two rays side by side wherever it is, as a multiple of their distance. So a thing
that one ray alone meets is narrower."""


@dataclass(frozen=True, slots=True)
class RobotPosture:
    """Posture of the robot by its own sensors.

    Attributes:
        joints: joint positions, rad.
        base: position of the arm's base by odometry, m.
    """

    joints: Sequence[float]
    base: Vector3


class PersonDistance:
    """The distance of people, from scan to scan.

    Args:
        scanners: the scanners.
        taught: length of each ray in the cell as it was surveyed, with nobody and no robot in it (n,), m.
        robot: the robot.
        carriage: it stands on its carriage.
        farthest: distance if nobody is there, m.

    Attributes:
        awaits_next_scan: in the newest scan a ray alone, nearer than all else, was shorter, perhaps by noise.
            If it has met somebody, the next scan shows it; the distance is of who was there a scan before.
    """

    def __init__(
        self, scanners: AreaScanners, taught: Array, robot: RobotModel, *, carriage: bool, farthest: float
    ) -> None:
        self._robot = robot
        self._fan = ray_fan(scanners)
        self._plane = scanners.floor + scanners.height
        self._allowance = scanners.allowance
        self._nearest_expected = taught - scanners.allowance
        self._grid = SightGrid(scanners, taught)
        self._carriage = carriage
        self._farthest = farthest
        self._displacement = np.zeros(2)
        self._play = _PLAY * scanners.noise
        self._distance = farthest
        self._step = scanners.step
        self._way = _PERSON_SPEED * _SCANS_APART * scanners.period
        self._intruders_before: Indices | None = None
        self.awaits_next_scan = False

    def evaluate(self, ranges: Array, posture: RobotPosture) -> float | None:
        """Evaluate the scans of one moment.

        Args:
            ranges: measured length of each ray (n,), m.
            posture: of the robot at that moment.

        Returns:
            The distance of the nearest person, m; None if a scanner's window is dirty or covered.
        """
        if ranges.min() < NEAR_RANGE:
            return None
        is_shorter = ranges < self._nearest_expected
        shorter = np.flatnonzero(is_shorter)
        if not len(shorter):
            self._intruders_before, self.awaits_next_scan = shorter, False
            return self._settle(self._farthest)
        lengths = ranges[shorter]
        points = self._fan.origins[shorter] + lengths[:, None] * self._fan.directions[shorter]
        robot = self._outline(posture)
        own = robot.covers(points, self._allowance)
        if self._carriage:
            self._displacement += _TRACKING_SHARE * robot.offset_of_carriage(points[own])
        if robot.reaches_down_to(self._plane + self._allowance):
            own |= robot.covers_with_links(points, self._plane, self._allowance)
        hidden = self._grid.hidden_places(shorter, lengths, robot, self._plane)
        is_met = self._is_met(shorter[~own], ranges, is_shorter)
        places, alone = np.concatenate((points[~own][is_met], hidden)), points[~own][~is_met]
        nearest = robot.distance(places) if len(places) else self._farthest
        # What one that is farther away has met makes no difference.
        self.awaits_next_scan = bool(len(alone)) and robot.distance(alone) < nearest
        if not len(places):
            return self._settle(self._farthest)
        return self._settle(max(0.0, min(self._farthest, nearest - self._allowance)))

    def _is_met(self, intruders: Indices, ranges: Array, is_shorter: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Say which of the rays that something else than the robot has shortened met somebody: not noise."""
        before, self._intruders_before = self._intruders_before, intruders
        is_met: NDArray[np.bool_] = (np.roll(is_shorter, 1) | np.roll(is_shorter, -1))[intruders]
        if before is None:  # nothing says that a ray is noise
            return np.ones_like(is_met)
        for place in np.flatnonzero(~is_met).tolist():
            ray = int(intruders[place])
            apart = self._step * float(ranges[ray])
            is_near = np.abs(before - ray) * apart <= self._way + _WIDTH * apart
            is_of_scanner = before // self._fan.per_scanner == ray // self._fan.per_scanner
            is_met[place] = (is_near & is_of_scanner).any()
        return is_met

    def _settle(self, distance: float) -> float:
        """Follow a distance that falls at once, and one that rises as soon as it is beyond noise."""
        is_free = distance == self._farthest
        self._distance = distance if is_free else min(distance, max(self._distance, distance - self._play))
        return self._distance

    def _outline(self, posture: RobotPosture) -> RobotOutline:
        x, y, z = posture.base
        dx, dy = self._displacement.tolist()
        return RobotOutline(self._robot, posture.joints, (x + dx, y + dy, z), carriage=self._carriage)
