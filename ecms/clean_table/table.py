"""The table in a picture: its plane, the heights of points over it, and the dirt on it."""

import numpy as np

from aeros.perception import (
    CameraError,
    Level,
    Picture,
    Points,
    believe_height,
    correct_points,
    erode,
    level_ground,
)

from .places import AREA, FLAT, INSPECTED, MIN_TABLE, Place, corners_in_world, in_rectangle, part_of

CELL = 0.01
"""Edge of a cell in which dirt is judged, m."""

WIPED_SHARE = 0.95
"""Least share of clean cells of a wiped area."""

DIRT_BRIGHTNESS = 0.7
"""Share of the bare table's brightness below which a pixel shows dirt."""

PAPER_BRIGHTNESS = 1.2
"""The same in any colour above which a pixel shows what is no table, such as paper."""

LEAST_PATCH = 4
"""Number of pixels of a patch without its two outermost ones from which it is more than a streak: it is some
2 cm long and wide, and may be a thing that wiping does not remove."""

NEAR_TABLE = 0.06
"""Greatest height over the surveyed table of a point that the table is fitted to, m: a camera that is tilted
by 1° has it 10 mm off at the ends, and the table may be some 20 mm higher or lower."""

OFF_TABLE = 0.004
"""Greatest distance from its plane of such a point, m: the bin's floor is 5 mm up."""

CALIBRATED_WITHIN = 0.005
"""Greatest error of the table's height in a picture whose camera's error is known, m."""

UNNOTICED = 0.012
"""Greatest displacement of a camera that nobody notices, m: a table that is seen higher or lower by more
is."""


def is_wiped(clean: float, unseen: float, is_patch_left: bool) -> bool | None:
    """Judge the shares of clean and of unseen cells; None if it depends on the unseen ones."""
    if is_patch_left:
        return False
    if clean >= WIPED_SHARE:
        return True
    return None if clean + unseen >= WIPED_SHARE else False


def level_table(picture: Picture, area: Place) -> Level | None:
    """Turn the camera until the table is level; None if the picture shows no table."""
    points = picture.points()
    near = in_rectangle(points, *corners_in_world(area, INSPECTED))
    near &= np.abs(points[:, :, 2] - area[2]) < NEAR_TABLE
    return level_ground(picture, near, OFF_TABLE, MIN_TABLE)


def points_above_table(
    picture: Picture, level: Level | None, area: Place, error: CameraError | None
) -> tuple[Points, float | None]:
    """Return the points of a picture, whose z counts from the table, and the table's height in the world.

    The height is None if the picture shows no table. A camera's known error is corrected.
    """
    if level is None:
        return picture.points() - np.array((0.0, 0.0, area[2])), None
    points, height, unnoticed = level.points, level.height, UNNOTICED
    if error is not None:
        points, height = correct_points(points, error.turn, error.shift), height + error.shift[2]
        unnoticed = CALIBRATED_WITHIN
    return points - np.array((0.0, 0.0, height)), believe_height(height, area[2], unnoticed)


def clean_share(points: Points, rgb: Points, area: Place, region: str) -> tuple[float, float, bool]:
    """Return the shares of the region's cells that are clean, and that the picture does not show.

    Most pixels of a clean cell are as bright as the table around the whole area.  The third value is True if
    a patch of others is left.
    """
    low, high = corners_in_world(area, part_of(AREA, region))
    top = in_rectangle(points, *corners_in_world(area, INSPECTED)) & (np.abs(points[:, :, 2]) < FLAT)
    inside = top & in_rectangle(points, low, high)
    outside = top & ~in_rectangle(points, *corners_in_world(area, AREA))
    if not outside.any():
        return 0.0, 1.0, False
    shares = rgb / np.maximum(np.median(rgb[outside], axis=0), 1.0)
    bright = (shares[:, :, 0] > DIRT_BRIGHTNESS) & (shares.max(axis=2) < PAPER_BRIGHTNESS)
    columns, rows = (round((b - a) / CELL) for a, b in zip(low, high, strict=True))
    cells = ((points[inside][:, :2] - np.array(low)) / CELL).astype(np.intp)
    cell = np.clip(cells[:, 1], 0, rows - 1) * columns + np.clip(cells[:, 0], 0, columns - 1)
    seen = np.bincount(cell, minlength=rows * columns)
    bright_ones = np.bincount(cell, weights=bright[inside], minlength=rows * columns)
    patches = int(erode(erode(inside & ~bright)).sum())
    return float((bright_ones * 2.0 > seen).mean()), float((seen == 0).mean()), patches >= LEAST_PATCH
