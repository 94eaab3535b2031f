"""Small cells with scanners, and scans of them without noise."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cache
from math import radians
from typing import Final

import numpy as np
from numpy.typing import NDArray

from aeros.sim.geometry import Vector3
from aeros.sim.randomness import RandomSource
from aeros.sim.scanners.person_distance import PersonDistance, RobotPosture
from aeros.sim.scanners.ray_fan import Array
from aeros.sim.scanners.scanner_set import ScannerSet
from aeros.sim.scanners.sections import Section
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.sensor_errors import AreaScanners, ScannerPlacement
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import reference_site_path
from tests.unit.sim.robot.panda import PANDA, READY_POSTURE

FARTHEST: Final = 20.0

READY: Final = tuple(float(q) for q in READY_POSTURE)


@cache
def reference_site() -> Site:
    """The reference site."""
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    return site


def reference_scanners() -> AreaScanners:
    """The scanners of the reference site."""
    scanners = reference_site().area_scanners
    assert scanners is not None
    return scanners


def scanners_at(*places: tuple[float, float, float], **more: float) -> AreaScanners:
    """Scanners 0.2 m above the floor, without noise; x and y in m, and facing in degrees."""
    numbers = {"noise": 0.0, "allowance": 0.1, "dropout": 0.0, "range": 5.5, "latency": 0.035} | more
    placed = tuple(
        ScannerPlacement(f"s{number}", x, y, radians(facing)) for number, (x, y, facing) in enumerate(places)
    )
    return AreaScanners(
        measures="human_distance",
        floor=-0.3,
        height=0.2,
        field_of_view=radians(275.0),
        step=radians(0.5),
        period=0.03,
        scanners=placed,
        **numbers,
    )


CORNERS: Final = ((-2.0, -2.0, 45.0), (2.0, -2.0, 135.0), (2.0, 2.0, -135.0), (-2.0, 2.0, -45.0))


@dataclass
class Cell:
    """A cell with the robot's carriage at its origin, what stands in it, and who walks there."""

    scanners: AreaScanners = field(default_factory=lambda: scanners_at(*CORNERS))
    furniture: tuple[Section, ...] = ()
    carriage: bool = True

    def __post_init__(self) -> None:
        self.devices = ScannerSet(self.scanners, RandomSource(3), PANDA, carriage=self.carriage)
        taught = self.devices.teach(self.furniture)
        self.controller = PersonDistance(
            self.scanners, taught, PANDA, carriage=self.carriage, farthest=FARTHEST
        )
        self.count = 0

    def scan(
        self,
        others: Iterable[Section] = (),
        base: Vector3 = (0.0, 0.0, 0.0),
        joints: tuple[float, ...] = READY,
    ) -> Array:
        """Scan once."""
        self.count += 1
        return self.devices.scan(self.count, self.furniture, tuple(others), joints, base)

    def distance(
        self,
        *others: Section,
        base: Vector3 = (0.0, 0.0, 0.0),
        believed: Vector3 | None = None,
        joints: tuple[float, ...] = READY,
    ) -> float | None:
        """Scan and evaluate once."""
        ranges = self.scan(others, base, joints)
        return self.controller.evaluate(ranges, RobotPosture(joints, believed or base))


def inside(section: Section, points: Array, margin: float = 0.0) -> NDArray[np.bool_]:
    """Points that are inside a section, by its definition."""
    if len(section) == 3:
        x, y, radius = section
        found: NDArray[np.bool_] = np.hypot(points[:, 0] - x, points[:, 1] - y) <= radius + margin
        return found
    _, _, _, normals, offsets = section
    within: NDArray[np.bool_] = np.logical_and.reduce(points @ normals.T <= offsets + margin, axis=1)
    return within
