"""Places and parts of the table: regions, rectangles, and how much of them a picture shows.

All lengths in metres, in the world frame.
"""

from math import inf

import numpy as np

from aeros.perception import Mask, Points, largest_gap, seen_cells

Place = tuple[float, float, float]

Corners = tuple[tuple[float, float], tuple[float, float]]

AREA = ((-0.15, -0.15), (0.15, 0.15))
"""Lowest and highest corner (x, y) of the area to wipe, from its middle, m."""

REGIONS = {"whole": (-inf, inf), "left": (0.0, inf), "right": (-inf, 0.0)}
"""Bounds of each region that an instruction may say, along y from the middle of the area to wipe, m."""

WAY_AROUND = 0.04
"""Distance from the area within which sponge and fingers pass, m."""

FLAT = 0.012
"""Greatest height of the table's own points, m: depth is some millimetres off."""

STANDING = (FLAT, 0.30)
"""Height range of anything that stands on the table, m: above is the arm."""

INSPECTED = ((-0.20, -0.62), (0.25, 0.50))
"""Lowest and highest corner (x, y) of the inspected area, from the middle of the area to wipe, m: all of the
table that the arm works on."""

COVERED = ((-0.18, -0.62), (0.25, 0.50))
"""The part of it that is surely table, and not its front edge."""

SEEN_CELL, HIDING_CELLS = 0.02, 4
"""Edge of a cell that a picture shows or not, m, and the number of cells in which a piece can hide."""

MIN_PIXELS = 25
"""Least number of pixels of an object: fewer are noise, or an object that is mostly hidden."""

MIN_TABLE = 1000
"""Least number of pixels of the table: a picture with fewer shows no table."""

UNCERTAINTY = 0.005
"""Standard uncertainty of a place, m: a pixel is 4 mm."""


def is_on_table(points: Points) -> Mask:
    """Find the points that show what is on the table at a place, or that nothing is."""
    z = points[:, :, 2]
    tells: Mask = (z > -FLAT) & (z < STANDING[1])
    return tells


def is_all_shown(shown: Points, area: Place, corners: Corners, known: list[Corners]) -> bool:
    """Return True if no object fits in what is not shown of a rectangle, but for places that are known."""
    low, high = corners_in_world(area, corners)
    seen = seen_cells(shown, low, high, SEEN_CELL)
    columns, rows = seen.shape
    x = low[0] + (np.arange(columns) + 0.5) * SEEN_CELL
    y = low[1] + (np.arange(rows) + 0.5) * SEEN_CELL
    for (left, near), (right, far) in known:
        seen |= ((x > left) & (x < right))[:, None] & ((y > near) & (y < far))[None, :]
    return largest_gap(seen) < HIDING_CELLS


def passed_by_hand(region: str) -> Corners:
    """Return the corners of where sponge and fingers pass, from the middle of the area."""
    (left, near), (right, far) = part_of(AREA, region)
    return (left - WAY_AROUND, near - WAY_AROUND), (right + WAY_AROUND, far + WAY_AROUND)


def part_of(corners: Corners, region: str) -> Corners:
    """Return the part of a rectangle, in metres from the middle of the area, that a region covers."""
    ((left, near), (right, far)), (low, high) = corners, REGIONS[region]
    return (left, max(near, low)), (right, min(far, high))


def reaches(points: Points, corners: Corners) -> bool:
    """Return True if some point (n, 3) is over a rectangle."""
    low, high = np.array(corners)
    return bool(((points[:, :2] > low) & (points[:, :2] < high)).all(axis=1).any())


def corners_in_world(area: Place, corners: Corners) -> Corners:
    """Return corners that count from the middle of the area in the world frame."""
    (x, y, _), ((left, near), (right, far)) = area, corners
    return (x + left, y + near), (x + right, y + far)


def raise_place(place: Place, height: float) -> Place:
    """Return the place that is higher by `height`, m."""
    return (place[0], place[1], place[2] + height)


def is_standing(points: Points) -> Mask:
    """Find the points of anything that stands on the table."""
    z = points[:, :, 2]
    stands: Mask = (z > STANDING[0]) & (z < STANDING[1])
    return stands


def in_rectangle(points: Points, low: tuple[float, float], high: tuple[float, float]) -> Mask:
    """Find the points over a rectangle with these corners."""
    x, y = points[:, :, 0], points[:, :, 1]
    return (low[0] < x) & (x < high[0]) & (low[1] < y) & (y < high[1])
