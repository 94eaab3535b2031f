"""The rays of all scanners of a cell, in one array. Frame: x and y of W. Units: m, rad."""

from __future__ import annotations

from functools import lru_cache
from math import floor
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeros.spec.model.sensor_errors import AreaScanners

Array = NDArray[np.float64]


class RayFan(NamedTuple):
    """Rays of all scanners, those of each scanner in order of their angle.

    Attributes:
        origins: start of each ray (n, 2), m.
        directions: unit vector of each ray (n, 2).
        cross_products: x·d_y − y·d_x of each ray's origin and direction (n,), m.
        dot_products: x·d_x + y·d_y of each ray's origin and direction (n,), m.
        per_scanner: number of rays of each scanner.
    """

    origins: Array
    directions: Array
    cross_products: Array
    dot_products: Array
    per_scanner: int

    def rays_of(self, scanner: int) -> slice:
        """Select the rays of a scanner.

        Args:
            scanner: its number.

        Returns:
            Where they are in the arrays.
        """
        return slice(scanner * self.per_scanner, (scanner + 1) * self.per_scanner)


@lru_cache(maxsize=8)
def ray_fan(scanners: AreaScanners) -> RayFan:
    """Compute the rays of scanners.

    Args:
        scanners: the scanners.

    Returns:
        Their rays.
    """
    count = floor(scanners.field_of_view / scanners.step + 1e-9) + 1
    spread = (np.arange(count) - (count - 1) / 2.0) * scanners.step
    angles = np.concatenate([one.facing + spread for one in scanners.scanners])
    origins = np.repeat([(one.x, one.y) for one in scanners.scanners], count, axis=0)
    directions = np.column_stack((np.cos(angles), np.sin(angles)))
    (x, y), (dx, dy) = origins.T, directions.T
    return RayFan(origins, directions, x * dy - y * dx, x * dx + y * dy, count)
