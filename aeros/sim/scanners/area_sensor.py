"""The sensor that measures how far people are: scanners that scan, and the controller that evaluates scans.

A scan shows the moment at which it begins; what comes of it arrives after the latency. A reading stays until
the next arrives, and ages meanwhile. If a scan leaves open whether a ray is noise, it makes certain only who
was there at the scan before: its reading is of that moment.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from math import ceil
from typing import Final, Protocol

from aeros.runtime.ports import Reading
from aeros.sim.clock import TICK
from aeros.sim.geometry import Vector3
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.limits import SCANNER_RANGE
from aeros.sim.robot.model import RobotModel
from aeros.sim.scanners.person_distance import PersonDistance, RobotPosture
from aeros.sim.scanners.robot_outline import RobotOutline
from aeros.sim.scanners.scanner_set import ScannerSet
from aeros.sim.scanners.sections import Section
from aeros.spec.model.sensor_errors import AreaScanners

_PLACES: Final = 3
"""Decimal places of a metre of the base's position that matter: by less, it has not moved."""


class ScannedCell(Protocol):
    """A cell as scanners meet it with their rays."""

    def furniture(self) -> Sequence[Section]:
        """Cut everything but people and the robot with the scan plane.

        Returns:
            The sections; the same object as long as nothing has moved.
        """

    def people(self) -> Sequence[Section]:
        """Cut people with the scan plane.

        Returns:
            The sections.
        """

    def robot(self) -> tuple[Sequence[float], Vector3]:
        """Locate the robot.

        Returns:
            True joint positions (7), rad, and true position of the arm's base, m.
        """


class AreaSensor:
    """Readings of the distance of people.

    Its first reading is there when the clock starts: the cell was at rest before.

    Args:
        scanners: the scanners.
        cell: what their rays meet; surveyed as it is now.
        chance: random source of noise and losses.
        robot: the robot.
        carriage: it stands on its carriage.

    Attributes:
        devices: the scanners, which faults may cover or silence.
        reading: the newest reading that has arrived; None before the first.
    """

    def __init__(
        self,
        scanners: AreaScanners,
        cell: ScannedCell,
        chance: RandomSource,
        robot: RobotModel,
        *,
        carriage: bool,
    ) -> None:
        self._model = robot
        self._cell = cell
        self._period = scanners.period / TICK
        self._latency = ceil(scanners.latency / TICK - 1e-9)
        self.devices = ScannerSet(scanners, chance, robot, carriage=carriage)
        self._controller = PersonDistance(
            scanners,
            self.devices.teach(cell.furniture()),
            robot,
            carriage=carriage,
            farthest=SCANNER_RANGE,
        )
        self._scans = 0
        self._under_way: deque[tuple[int, Reading]] = deque()
        self._plane = scanners.floor + scanners.height
        self._furniture: Sequence[Section] = ()
        self._before: tuple[object, ...] = ()
        self._distance: float | None = None
        self._newest: tuple[float, float] | None = None
        self.reading: Reading | None = None

    def start(self, posture: RobotPosture) -> None:
        """Scan for the first time.

        Args:
            posture: of the robot.
        """
        distance = self._scan(posture)
        if distance is None:
            return
        ticks = [-round(back * self._period) for back in range(ceil(self._latency / self._period), -1, -1)]
        for tick in ticks:
            self._under_way.append((tick + self._latency, Reading(distance, tick * TICK)))
        self._newest = (distance, 0.0)
        self._deliver(0)

    def tick(self, tick: int, posture: RobotPosture) -> None:
        """Scan if it is time, and deliver what arrives.

        Args:
            tick: number of the tick.
            posture: of the robot.
        """
        if tick >= round(self._scans * self._period):
            distance = self._scan(posture)
            if distance is not None:
                self._under_way.append((tick + self._latency, self._certain(distance, tick * TICK)))
        self._deliver(tick)

    def _scan(self, posture: RobotPosture) -> float | None:
        number = self._scans
        self._scans += 1
        if self.devices.loses(number):
            return None
        furniture, people = self._cell.furniture(), self._cell.people()
        joints, base = self._cell.robot()
        at = tuple([round(part, _PLACES) for part in base])
        low = self._low_joints(joints, base)
        state = (low, at, self.devices.covered)
        is_as_before = furniture is self._furniture and state == self._before
        is_open = self._controller.awaits_next_scan or self._distance != SCANNER_RANGE
        if people or not is_as_before or is_open:
            ranges = self.devices.scan(number, furniture, people, low, base)
            self._distance = self._controller.evaluate(ranges, posture)
        # Nothing has moved in the plane, in which nobody was: the scan would be as before but for its noise.
        self._furniture, self._before = furniture, () if people else state
        return self._distance

    def _certain(self, distance: float, time: float) -> Reading:
        """Read what a scan makes certain, and for which moment: its own, or that of the scan before."""
        before, self._newest = self._newest, (distance, time)
        if before is None or not self._controller.awaits_next_scan:
            return Reading(distance, time)
        return Reading(min(distance, before[0]), before[1])

    def _low_joints(self, joints: Sequence[float], base: Vector3) -> Sequence[float]:
        """Return the joint positions of an arm that reaches down to the plane; else none."""
        outline = RobotOutline(self._model, joints, base, carriage=False)
        return joints if outline.reaches_down_to(self._plane) else ()

    def _deliver(self, tick: int) -> None:
        while self._under_way and self._under_way[0][0] <= tick:
            self.reading = self._under_way.popleft()[1]
