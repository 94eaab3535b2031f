"""A grid of points in the scan plane, and which of them the scanners see. Frame: x and y of W. Units: m.

A scanner sees a point if the ray nearest to it is longer than the way to the point.
"""

from __future__ import annotations

from functools import lru_cache
from math import pi
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeros.sim.scanners.ray_fan import Array, ray_fan
from aeros.sim.scanners.robot_outline import RobotOutline
from aeros.spec.model.sensor_errors import AreaScanners

SPACING: Final = 0.05
"""Distance of neighbouring points, m."""

_SURFACE: Final = 0.05
"""Distance behind a surface at which a point counts as hidden by it, m: a person is thicker."""

_BEYOND: Final = 2.6
"""Distance beyond the outermost scanners up to which there are points, m: the robot stays between them, and
no separation rule asks for more."""

_LONG: Final = 1e3
"""Length above that of every ray, m."""

Indices = NDArray[np.intp]


class _Passes(NamedTuple):
    """Points that rays pass, sorted by ray and way.

    Attributes:
        columns: number of columns of the grid, along y.
        points: position of each point (p, 2), m; rows along x.
        keys: ray · _LONG + way from the scanner to the point (k,).
        ids: number of the point (k,).
    """

    columns: int
    points: Array
    keys: Array
    ids: Indices


class SightGrid:
    """Points that scanners saw when the cell was surveyed.

    Args:
        scanners: the scanners.
        taught: length of each ray in the surveyed cell (n,), m.
    """

    def __init__(self, scanners: AreaScanners, taught: Array) -> None:
        self._passes = _passes(scanners)
        self._rays = np.arange(len(taught)) * _LONG
        # What was behind a surface is inside a thing that stands there, where nobody can be.
        self._ends = np.searchsorted(self._passes.keys, self._rays + taught)
        seen = np.zeros(len(self._passes.keys) + 1, np.intp)
        starts = np.searchsorted(self._passes.keys, self._rays)
        np.add.at(seen, starts, 1)
        np.add.at(seen, self._ends, -1)
        is_seen = np.cumsum(seen[:-1]) > 0
        self._times_seen = np.bincount(self._passes.ids[is_seen], minlength=len(self._passes.points))

    @property
    def points(self) -> Array:
        """All points of the grid (p, 2), m."""
        return self._passes.points

    @property
    def surveyed(self) -> Array:
        """Points that some scanner saw when the cell was surveyed (m, 2), m."""
        seen: Array = self._passes.points[self._times_seen > 0]
        return seen

    def hidden_places(self, rays: Indices, ranges: Array, own: RobotOutline, plane: float) -> Array:
        """Find surveyed places that no scanner sees now and that are wide enough for a person.

        A place is a square of four neighbouring points, none of them inside the robot. The two legs of a
        person who stands, 200 mm by 110 mm together, cover such a square wherever they stand.

        Args:
            rays: numbers of the rays that are shorter than in the surveyed cell (k,).
            ranges: length of each of them (k,), m.
            own: outline of the robot.
            plane: height of the scan plane in W, m; a hand that reaches down to it fills a place, too.

        Returns:
            The points of such places (m, 2), m.
        """
        passes = self._passes
        begins = np.searchsorted(passes.keys, self._rays[rays] + ranges + _SURFACE)
        counts = np.maximum(self._ends[rays] - begins, 0)
        total = int(counts.sum())
        if total == 0:
            return _NONE
        offsets = np.repeat(begins - (np.cumsum(counts) - counts), counts)
        ids = passes.ids[offsets + np.arange(total)]
        blocked = np.bincount(ids, minlength=len(passes.points))
        hidden = ids[blocked[ids] == self._times_seen[ids]]
        hidden = np.unique(hidden)
        hidden = hidden[~own.covers(passes.points[hidden])]
        if len(hidden) and own.reaches_down_to(plane):
            hidden = hidden[~own.covers_with_links(passes.points[hidden], plane, 0.0)]
        if not len(hidden):
            return _NONE
        is_hidden = np.zeros(len(passes.points) + passes.columns + 1, dtype=bool)
        is_hidden[hidden] = True
        rows = hidden[(hidden + 1) % passes.columns != 0]
        corner = rows[
            is_hidden[rows + 1] & is_hidden[rows + passes.columns] & is_hidden[rows + passes.columns + 1]
        ]
        if not len(corner):
            return _NONE
        squares = np.unique(
            np.concatenate([corner + step for step in (0, 1, passes.columns, passes.columns + 1)])
        )
        places: Array = passes.points[squares]
        return places


_NONE: Final = np.empty((0, 2))


@lru_cache(maxsize=8)
def _passes(scanners: AreaScanners) -> _Passes:
    fan = ray_fan(scanners)
    beyond = min(scanners.range, _BEYOND)
    lowest, highest = fan.origins.min(axis=0) - beyond, fan.origins.max(axis=0) + beyond
    axes = [np.arange(low, high, SPACING) for low, high in zip(lowest, highest, strict=True)]
    x, y = np.meshgrid(*axes, indexing="ij")
    points = np.column_stack((x.ravel(), y.ravel()))
    keys, ids = [], []
    for number, one in enumerate(scanners.scanners):
        dx, dy = (points - (one.x, one.y)).T
        turn = (np.arctan2(dy, dx) - one.facing + pi) % (2.0 * pi) - pi
        ray = np.rint(turn / scanners.step + (fan.per_scanner - 1) / 2.0).astype(np.intp)
        way = np.hypot(dx, dy)
        in_view = np.flatnonzero((ray >= 0) & (ray < fan.per_scanner) & (way < scanners.range))
        keys.append((ray[in_view] + number * fan.per_scanner) * _LONG + way[in_view])
        ids.append(in_view)
    all_keys, all_ids = np.concatenate(keys), np.concatenate(ids)
    order = np.argsort(all_keys, kind="stable")
    return _Passes(len(axes[1]), points, all_keys[order], all_ids[order])
