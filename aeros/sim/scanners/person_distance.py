"""Distance of the nearest person from the robot, from what scanners measure.

This is the safety controller's part: it knows the scans, the cell as it was surveyed empty, and the robot's
own joint positions and odometry, and nothing else of the world.

What is nearer to a scanner than in the surveyed cell is the robot itself or an intruder, which two rays side
by side meet. A place that some
scanner saw then and none sees now may hide a person. The distance is that of the nearest intruder or place,
less what the scanner may be wrong by. Nobody knows how tall an intruder is, so distances are level ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from aeros.sim.geometry import Vector3
from aeros.sim.robot.model import RobotModel
from aeros.sim.scanners.ray_fan import Array, ray_fan
from aeros.sim.scanners.robot_outline import RobotOutline
from aeros.sim.scanners.sight_grid import SightGrid
from aeros.spec.model.sensor_errors import AreaScanners

NEAR_RANGE: Final = 0.05
"""Least distance that a scanner measures, m: a nearer one is its own window, which is dirty or covered.
Source: SICK, operating instructions of the nanoScan3 I/O, 8024596, section 4.3.2."""

_TRACKING_SHARE: Final = 0.2
"""Share of the carriage's measured displacement that is added from each scan; chosen, as a scan is noisy."""

_PLAY: Final = 3.0
"""Standard deviations of noise by which a distance must rise to count. Of somebody who stands still the
distance falls to its least value and stays there; else a rule at its bound would hold now and again."""


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
        # A leg is wider than two rays are apart, wherever it is; one ray alone is shorter by noise.
        is_paired = (np.roll(is_shorter, 1) | np.roll(is_shorter, -1))[shorter]
        places = np.concatenate((points[~own & is_paired], hidden))
        if not len(places):
            return self._settle(self._farthest)
        return self._settle(max(0.0, min(self._farthest, robot.distance(places) - self._allowance)))

    def _settle(self, distance: float) -> float:
        """Follow a distance that falls at once, and one that rises as soon as it is beyond noise."""
        is_free = distance == self._farthest
        self._distance = distance if is_free else min(distance, max(self._distance, distance - self._play))
        return self._distance

    def _outline(self, posture: RobotPosture) -> RobotOutline:
        x, y, z = posture.base
        dx, dy = self._displacement.tolist()
        return RobotOutline(self._robot, posture.joints, (x + dx, y + dy, z), carriage=self._carriage)
