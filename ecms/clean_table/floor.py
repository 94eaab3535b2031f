"""Search of the floor for the sponge, or a piece, that the table has lost."""

import numpy as np

from aeros.perception import Picture, min_area_rectangle, separate_parts

from .places import MIN_PIXELS, MIN_TABLE, STANDING, Place, corners_in_world, in_rectangle
from .sponge import is_yellow

FLOOR_AROUND, FLOOR_BELOW = ((-0.70, -1.30), (0.90, 1.10)), 0.15
"""Lowest and highest corner (x, y) of the floor that is looked over for what fell, from the middle of the
area to wipe, and its least depth below the table, m."""

FALLEN_HEIGHT, FALLEN_LENGTH = 0.15, 0.17
"""Greatest height and length of what fell, m."""

CARRIAGE = (0.32, 0.30)
"""Half the length and width of what the arm stands on, with a margin, m."""


def find_on_floor(picture: Picture, area: Place, base: Place) -> dict[str, Place]:
    """Find what lies on the floor: small, flat, and not at what the arm stands on."""
    points = picture.points()
    below = in_rectangle(points, *corners_in_world(area, FLOOR_AROUND)) & (
        points[:, :, 2] < area[2] - FLOOR_BELOW
    )
    if int(below.sum()) < MIN_TABLE:
        return {}
    floor = float(np.median(points[below][:, 2]))
    x, y = np.abs(points[:, :, 0] - base[0]), np.abs(points[:, :, 1] - base[1])
    above = points[:, :, 2] - floor
    lies = below & (above > STANDING[0]) & (above < FALLEN_HEIGHT) & ((x > CARRIAGE[0]) | (y > CARRIAGE[1]))
    yellow = is_yellow(picture.rgb.astype(np.float64))
    found: dict[str, Place] = {}
    for part in separate_parts(lies, MIN_PIXELS):
        box = min_area_rectangle(points[part][:, :2])
        if max(box.length, box.width) > FALLEN_LENGTH:
            continue
        is_sponge = bool(2 * int((part & yellow).sum()) > int(part.sum()))
        found["sponge" if is_sponge else "piece"] = (box.x, box.y, floor)
    return found
