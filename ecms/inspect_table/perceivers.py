"""Perceiver of an inspection: the cells of a table that pictures from above and from the mast show.

All lengths in metres, in the world frame; heights in a picture count from the table's top, which is the plane
that is fitted to it.
"""

import numpy as np

from aeros.perception import Mask, Perception, Picture, View, level_ground, seen_cells

Place = tuple[float, float, float]

TABLE = ((-0.18, -0.62), (0.25, 0.50))
"""Lowest and highest corner (x, y) of the inspected part, from the middle of the area to wipe, m: all of the
table that the arm works on, and not its front edge."""

AROUND = 0.05
"""Margin around that part of the points that the table's plane is fitted to, m."""

NEAR_TABLE = 0.06
"""Greatest height over the surveyed table of a point that the plane is fitted to, m."""

OFF_TABLE = 0.004
"""Greatest distance from its plane of such a point, m."""

MIN_TABLE = 1000
"""Least number of pixels of the table: a picture with fewer shows no table."""

SHOWN = (-0.012, 0.30)
"""Height range of what shows a cell, m: the table, and what lies or stands on it; above is the arm."""

CELL = 0.02
"""Edge of a cell, m: a piece of twice that width, 4 cm, hides in a square of four cells."""


def see_all(view: View) -> Perception:
    """Judge whether the pictures show the whole table; unknown as long as one of them shows no table."""
    while True:
        readings = view.readings
        if "clean_table.area_position" not in readings:
            view = yield {}
            continue
        area = readings["clean_table.area_position"]
        seen = [_cells(view.pictures[name], area) for name in ("overhead", "mast")]
        known = [one for one in seen if one is not None]
        if len(known) < len(seen):
            view = yield {}
            continue
        view = yield {"table_inspected": not _has_room_to_hide(known[0] | known[1])}


def _cells(picture: Picture, area: Place) -> Mask | None:
    """Return the cells of the table that a picture shows; None if it shows no table."""
    points = picture.points()
    (left, near), (right, far) = TABLE
    x, y = points[:, :, 0] - area[0], points[:, :, 1] - area[1]
    around = (x > left - AROUND) & (x < right + AROUND) & (y > near - AROUND) & (y < far + AROUND)
    on_table = around & (np.abs(points[:, :, 2] - area[2]) < NEAR_TABLE)
    level = level_ground(picture, on_table, OFF_TABLE, MIN_TABLE)
    if level is None:
        return None
    z = level.points[:, :, 2] - level.height
    shown = level.points[(z > SHOWN[0]) & (z < SHOWN[1])]
    low, high = (area[0] + left, area[1] + near), (area[0] + right, area[1] + far)
    return seen_cells(shown, low, high, CELL)


def _has_room_to_hide(seen: Mask) -> bool:
    """Return True if a square of four cells was not seen: the shadow of an edge is narrower."""
    hidden = ~seen
    return bool((hidden[:-1, :-1] & hidden[1:, :-1] & hidden[:-1, 1:] & hidden[1:, 1:]).any())
