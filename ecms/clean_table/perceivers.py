"""Perceivers of a table: sponge and clutter by colour and depth, dirt by brightness.

All lengths in metres, in the world frame; the table's top is z = 0. An object lies on its largest face: the
rectangle of least area around its top gives middle and heading, as its sides are straight.
"""

from math import dist, inf, pi
from typing import Any

import numpy as np

from aeros.perception import (
    Estimate,
    Mask,
    Perception,
    Picture,
    Points,
    View,
    estimate,
    has_dominant_colour,
    has_red_ratios,
    top_face,
    top_points,
    wrap_heading,
)

Place = tuple[float, float, float]

AREA = ((0.35, -0.15), (0.65, 0.15))
"""Lowest and highest corner (x, y) of the area to wipe, m."""

CELL = 0.01
"""Edge of a cell in which dirt is judged, m."""

WIPED_SHARE = 0.95
"""Least share of clean cells of a wiped area."""

DIRT_BRIGHTNESS = 0.7
"""Share of the bare table's brightness below which a pixel shows dirt."""

WAY_AROUND = 0.06
"""Distance from the area within which sponge and fingers pass, m."""

TOPS = (0.012, 0.12)
"""Height range of the tops of objects on the table, m: below is the table, above is the arm."""

STANDING = (0.012, 0.30)
"""Height range of anything that stands on the table, m."""

INSPECTED = ((0.22, -0.62), (0.75, 0.50))
"""Lowest and highest corner (x, y) of the inspected area, m: all of the table that the arm works on."""

MIN_PIXELS = 25
"""Least number of pixels of an object: fewer are noise, or an object that is mostly hidden."""

MIN_BRIGHTNESS = 60
"""Least brightness of a coloured pixel (of 255)."""

DOMINANCE = 1.5
"""Least ratio of a piece's colour to the two others, in any light."""

YELLOW = (0.6, 0.5)
"""Colour of the sponge: least green over red, greatest blue over red."""

SPONGE_LENGTHS = (0.0625, 0.13)
"""Bounds on the longer side of the sponge's top, m: it is 100 mm, and
70 mm where it stands on its end."""

SPONGE_HEIGHT = 0.03
"""Height of the sponge's foam, m."""

SPONGE_RADIUS = 0.08
"""Radius around the sponge's middle that belongs to the sponge, m."""

RETURNED_WITHIN = 0.03
"""Greatest distance of the sponge from its rest at which it counts as returned, m."""

BIN_HALF = (0.09, 0.08)
"""Half of the bin's inner length and width, m."""

BIN_DEPTH = 0.08
"""From the bin's floor to its opening, whose middle is surveyed, m."""

BIN_MARGIN = 0.015
"""Margin around the inside of the bin that belongs to the bin, m: its walls are 5 mm, and depth is a
pixel off."""

UNCERTAINTY = 0.005
"""Standard uncertainty of a place, m: a pixel is 4 mm."""

HEADING_UNCERTAINTY = 0.05
"""Standard uncertainty of a heading, rad."""


def see_table(view: View) -> Perception:
    """Find sponge, clutter and dirt in a picture from above; clutter that it does not show is not there."""
    while True:
        picture, readings = view.pictures["overhead"], view.readings
        points = picture.points()
        low = (points[:, :, 2] > TOPS[0]) & (points[:, :, 2] < TOPS[1])
        rgb = picture.rgb.astype(np.float64)
        colours = (has_dominant_colour(rgb, channel, DOMINANCE, MIN_BRIGHTNESS) for channel in (2, 1))
        sponge = _lying(points[low & _is_yellow(rgb)], pi, SPONGE_LENGTHS)
        values: dict[str, Any] = {"sponge_seen": sponge is not None}
        if sponge is not None:
            values["sponge_position"], values["sponge_yaw"] = _estimates(*sponge)
        clean = _clean_share(points, rgb)
        values["wiped_fraction"] = estimate(clean, 0.01)
        values["table_wiped"] = clean >= WIPED_SHARE
        if "bin_position" in readings:
            pieces = [_lying(points[low & colour], pi / 2.0) for colour in colours]
            loose = [
                one for one in pieces if one is not None and not _is_in_bin(one[0], readings["bin_position"])
            ]
            values["clutter_on_table"] = bool(loose)
            values["wiping_area_clear"] = not any(_is_in_the_way(place) for place, _ in loose)
            if loose:
                values["clutter_position"], values["clutter_yaw"] = _estimates(*loose[0])
            if "sponge_rest_position" in readings:
                rest = readings["sponge_rest_position"]
                is_back = sponge is not None and dist(sponge[0], rest) < RETURNED_WITHIN
                values["table_organized"] = not loose and is_back
        view = yield values


def check_table(view: View) -> Perception:
    """Judge a picture from the mast: the area is clean, the sponge at its rest, and nothing else is there.

    It is a second opinion: what other pictures showed is not used.
    """
    while True:
        readings = view.readings
        is_clean = None
        if "bin_position" in readings and "sponge_rest_position" in readings:
            is_clean = _is_clean(
                view.pictures["mast"], readings["bin_position"], readings["sponge_rest_position"]
            )
        view = yield {"table_verified": is_clean}


def _is_clean(picture: Picture, opening: Place, rest: Place) -> bool:
    points, rgb = picture.points(), picture.rgb.astype(np.float64)
    x, y, z = points[:, :, 0], points[:, :, 1], points[:, :, 2]
    standing = _in_rectangle(points, *INSPECTED) & (z > STANDING[0]) & (z < STANDING[1])
    foam = points[standing & _is_yellow(rgb)]
    if len(foam) < MIN_PIXELS:
        return False
    face = top_points(foam)
    u, v = ((face[:, :2].min(axis=0) + face[:, :2].max(axis=0)) / 2.0).tolist()
    sponge = (u, v, float(np.median(face[:, 2])) - SPONGE_HEIGHT / 2.0)
    in_bin = (np.abs(x - opening[0]) < BIN_HALF[0] + BIN_MARGIN) & (
        np.abs(y - opening[1]) < BIN_HALF[1] + BIN_MARGIN
    )
    other = standing & ~in_bin & (np.hypot(x - u, y - v) > SPONGE_RADIUS)
    is_empty = int(other.sum()) < MIN_PIXELS
    return is_empty and dist(sponge, rest) < RETURNED_WITHIN and _clean_share(points, rgb) >= WIPED_SHARE


def _lying(
    points: Points, period: float, lengths: tuple[float, float] = (0.0, inf)
) -> tuple[Place, float] | None:
    """Locate an object that looks the same when it is turned by `period`: its middle, and a hand's heading.

    Its middle is at half its height. The longer side of its top is between `lengths`, m; else it is another.
    """
    if len(points) < MIN_PIXELS:
        return None
    face, top = top_face(points)
    if not lengths[0] < max(face.length, face.width) < lengths[1]:
        return None
    return (face.x, face.y, top / 2.0), wrap_heading(face.longer_heading, period)


def _estimates(place: Place, heading: float) -> tuple[Estimate, Estimate]:
    return estimate(place, UNCERTAINTY), estimate(heading, HEADING_UNCERTAINTY)


def _is_yellow(rgb: Points) -> Mask:
    return has_red_ratios(rgb, (YELLOW[0], None), (None, YELLOW[1]), MIN_BRIGHTNESS)


def _is_in_bin(place: Place, opening: Place) -> bool:
    dx, dy, dz = (a - b for a, b in zip(place, opening, strict=True))
    return abs(dx) < BIN_HALF[0] and abs(dy) < BIN_HALF[1] and -BIN_DEPTH < dz < 0.0


def _is_in_the_way(place: Place) -> bool:
    """Return True if a piece's middle is where sponge and fingers pass."""
    low, high = AREA
    return all(a - WAY_AROUND < at < b + WAY_AROUND for a, at, b in zip(low, place, high, strict=False))


def _in_rectangle(points: Points, low: tuple[float, float], high: tuple[float, float]) -> Mask:
    x, y = points[:, :, 0], points[:, :, 1]
    return (low[0] < x) & (x < high[0]) & (low[1] < y) & (y < high[1])


def _clean_share(points: Points, rgb: Points) -> float:
    """Return the share of the area's cells that most of their pixels show as bright as the table around it.

    Cells that the picture does not show do not count as clean.
    """
    low, high = AREA
    red = rgb[:, :, 0]
    top = _in_rectangle(points, *INSPECTED) & (np.abs(points[:, :, 2]) < STANDING[0])
    inside = top & _in_rectangle(points, low, high)
    outside = top & ~inside
    if not outside.any():
        return 0.0
    bright = red > DIRT_BRIGHTNESS * np.median(red[outside])
    columns, rows = (round((b - a) / CELL) for a, b in zip(low, high, strict=True))
    cells = ((points[inside][:, :2] - np.array(low)) / CELL).astype(np.intp)
    cell = np.clip(cells[:, 1], 0, rows - 1) * columns + np.clip(cells[:, 0], 0, columns - 1)
    seen = np.bincount(cell, minlength=rows * columns)
    bright_ones = np.bincount(cell, weights=bright[inside], minlength=rows * columns)
    return float((bright_ones * 2.0 > seen).mean())
