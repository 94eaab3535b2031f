"""Perceivers of a table: the sponge by colour and size, what else stands there by depth, dirt by brightness.

All lengths in metres, in the world frame. The table's top is z = 0; in a picture it is the plane that is
fitted to it, from which heights count, but for the sponge's. An object lies on its largest face: the
rectangle of least area around its upper half gives its middle and heading, as its sides are straight.
"""

from collections.abc import Iterator
from math import cos, dist, inf, pi, sin
from typing import Any, NamedTuple

import numpy as np

from aeros.perception import (
    Mask,
    Perception,
    Picture,
    Points,
    Rectangle,
    View,
    erode,
    estimate,
    find_ground,
    has_red_ratios,
    heights_above,
    min_area_rectangle,
    separate_parts,
    top_face,
    top_points,
    wrap_heading,
)

Place = tuple[float, float, float]
Corners = tuple[tuple[float, float], tuple[float, float]]

AREA = ((-0.15, -0.15), (0.15, 0.15))
"""Lowest and highest corner (x, y) of the area to wipe, from its middle, m."""

CELL = 0.01
"""Edge of a cell in which dirt is judged, m."""

WIPED_SHARE = 0.95
"""Least share of clean cells of a wiped area."""

DIRT_BRIGHTNESS = 0.7
"""Share of the bare table's brightness below which a pixel shows dirt."""

WAY_AROUND = 0.04
"""Distance from the area within which sponge and fingers pass, m."""

FLAT = 0.012
"""Greatest height of the table's own points, m: depth is some millimetres off."""

OFF_TABLE = 0.003
"""Greatest distance from its plane of a point that the table is fitted to, m: the bin's floor is 5 mm up."""

FOAM_TOPS = (FLAT, 0.12)
"""Height range of the sponge's foam, m, however it lies."""

STANDING = (FLAT, 0.30)
"""Height range of anything that stands on the table, m: above is the arm."""

INSPECTED = ((-0.28, -0.62), (0.25, 0.50))
"""Lowest and highest corner (x, y) of the inspected area, from the middle of the area to wipe, m: all of the
table that the arm works on."""

SURVEYED = ("area_position", "bin_position", "sponge_rest_position")
"""Places that a verdict needs."""

MIN_PIXELS = 25
"""Least number of pixels of an object: fewer are noise, or an object that is mostly hidden."""

MIN_CORE = 4
"""Least number of pixels of a piece without its outermost ones: a wall of the bin has fewer."""

MIN_TABLE = 1000
"""Least number of pixels of the table: a picture with fewer shows no table."""

MIN_BRIGHTNESS = 60
"""Least brightness of a coloured pixel (of 255)."""

YELLOW = (0.6, 0.5)
"""Colour of the sponge: least green over red, greatest blue over red."""

SPONGE_LENGTHS = (0.0625, 0.13)
"""Bounds on the longer side of the sponge's top, m: it is 100 mm, and
70 mm where it stands on its end."""

SPONGE_HEIGHT = 0.03
"""Height of the sponge's foam, m."""

UPSIDE_DOWN = 0.055
"""Height of the foam's top above which it is not on the table, m: on its block it is 64 mm high."""

FACE_WIDTH = 0.05
"""Least width of the face of foam that does not stand on its side, m: it is 70 mm."""

SPONGE_RADIUS = 0.08
"""Radius around the sponge's middle that belongs to the sponge, m."""

SPONGE_MARGIN = 0.012
"""Margin around the foam of a sponge that lies flat, m: depth and edges are a pixel off."""

RETURNED_WITHIN = 0.03
"""Greatest distance of the sponge from its rest at which it counts as returned, m."""

BIN_HALF = (0.09, 0.08)
"""Half of the bin's inner length and width, m."""

BIN_DEPTH = 0.08
"""From the bin's floor to its opening, whose middle is surveyed, m."""

BIN_MARGIN = 0.015
"""Margin around the inside of the bin that belongs to the bin, m: its walls are 5 mm, and depth is a
pixel off."""

BIN_EDGE = 0.010
"""The same of a picture from above, m, where a piece may be at the wall."""

BIN_CELL = 0.006
"""Edge of the squares by which the area of what is in the bin is measured, m: a pixel is 4 mm."""

SAME_PLACE = 0.04
"""Distance within which a piece in two pictures is the same, m: about its width."""

BINNED_SHARE = 0.3
"""Least share of the volume that left the table by which the volume in the bin grows: the bin's wall and
other pieces may hide a part."""

BINNED_OF_MANY = 0.6
"""The same share where several pieces left the table since the last picture."""

LEAST_VOLUME = 2e-5
"""Change of a volume below which nothing has come or gone, m³: a third of a small piece."""

MISSING_SHARE = 0.6
"""Share of the smallest piece's volume above which what has left the table is a piece."""

HAND_ROOM = (0.15, 0.05)
"""Radius around the tool, and depth below it, of the hand and of what it holds, m."""

HAND_LOWEST = 0.12
"""Height below which the hand counts as something in the way, m: it hides what is there."""

GRASPABLE = (0.065, 0.15, 0.08)
"""Greatest shorter side, longer side and height of a piece that fits the hand and the bin, m."""

UNCERTAINTY = 0.005
"""Standard uncertainty of a place, m: a pixel is 4 mm."""

HEADING_UNCERTAINTY = 0.05
"""Standard uncertainty of a heading, rad."""


class Piece(NamedTuple):
    """A thing on the table that is neither the sponge nor the hand.

    Attributes:
        points: its points (n, 3), m; z counts from the table.
        place: its middle at half its height, m.
        heading: of its longer side, rad.
        sides: shorter side, longer side and height, m.
    """

    points: Points
    place: Place
    heading: float
    sides: tuple[float, float, float]


def see_table(view: View) -> Perception:
    """Find sponge, clutter and dirt in a picture from above; without the table in it, clutter is unknown.

    Clutter does not vanish: what has left the table without more in the bin is missing.
    """
    filled, missing, smallest, looked = 0.0, 0.0, inf, -1.0
    seen: list[tuple[Piece, int]] = []
    last_seen: Place | None = None
    while True:
        picture, readings = view.pictures["overhead"], view.readings
        if "area_position" not in readings:
            view = yield {}
            continue
        area = readings["area_position"]
        points, has_table = _level(picture, area)
        rgb = picture.rgb.astype(np.float64)
        # Where the sponge is, is compared with its surveyed rest, so it is measured in the world frame.
        sponge = _find_sponge(picture.points(), rgb)
        values: dict[str, Any] = {"sponge_seen": sponge is not None}
        if has_table or sponge is not None:
            values["sponge_upside_down"] = sponge is not None and _is_upside_down(*sponge)
        if sponge is not None:
            values["sponge_position"] = estimate(_middle(sponge), UNCERTAINTY)
            values["sponge_yaw"] = estimate(wrap_heading(sponge[0].longer_heading, pi), HEADING_UNCERTAINTY)
        clean = _clean_share(points, rgb, area)
        values["wiped_fraction"] = estimate(clean, 0.01)
        values["table_wiped"] = clean >= WIPED_SHARE
        if has_table and "bin_position" in readings:
            other = _in_rectangle(points, *_around(area, INSPECTED)) & _stands(points)
            other &= ~_is_bin(points, readings["bin_position"], BIN_EDGE)
            other &= ~_is_hand(points, readings.get("tool_position"))
            if sponge is not None:
                other &= ~_is_of_sponge(points, *sponge)
            loose = [
                one
                for one in _pieces(points, erode(other), other)
                if not _is_in_bin(one.place, readings["bin_position"])
            ]
            in_bin = _volume_in_bin(points, readings["bin_position"])
            if picture.time > looked:
                gone, seen = _compare(seen, loose)
                came = sum(_volume(one) for one, times in seen if times == 1)
                lost = sum(map(_volume, gone)) - came
                # The hand carries one piece at a time into the bin.
                share = BINNED_SHARE if len(gone) < 2 else BINNED_OF_MANY
                missing = _missing_volume(missing, lost, in_bin - filled, share)
                smallest = min([smallest, *(_volume(one) for one, times in seen if times > 1)])
                filled, looked = in_bin, picture.time
                if gone:
                    last_seen = gone[0].place
            is_missing = missing > MISSING_SHARE * smallest
            if is_missing and last_seen is not None:
                values["clutter_last_seen"] = estimate(last_seen, UNCERTAINTY)
            values["clutter_missing"] = is_missing
            values["clutter_on_table"] = bool(loose)
            values["wiping_area_clear"] = not any(
                _is_in_the_way(points[part], area) for part in separate_parts(other, MIN_PIXELS)
            )
            values |= _next_piece(loose, area)
            if "sponge_rest_position" in readings:
                rest = readings["sponge_rest_position"]
                is_back = sponge is not None and dist(_middle(sponge), rest) < RETURNED_WITHIN
                values["table_organized"] = not loose and is_back and not is_missing
        view = yield values


def check_table(view: View) -> Perception:
    """Judge a picture from the mast: the area is clean, the sponge at its rest, and nothing else is there.

    It is a second opinion: what other pictures showed is not used.
    """
    while True:
        readings = view.readings
        is_clean = None
        if all(name in readings for name in SURVEYED):
            is_clean = _is_clean(view.pictures["mast"], *(readings[name] for name in SURVEYED))
        view = yield {"table_verified": is_clean}


def _is_clean(picture: Picture, area: Place, opening: Place, rest: Place) -> bool:
    points, rgb = _level(picture, area)[0], picture.rgb.astype(np.float64)
    standing = _in_rectangle(points, *_around(area, INSPECTED)) & _stands(points)
    foam = points[standing & _is_yellow(rgb)]
    if len(foam) < MIN_PIXELS:
        return False
    face = top_points(foam)
    u, v = ((face[:, :2].min(axis=0) + face[:, :2].max(axis=0)) / 2.0).tolist()
    sponge = (u, v, float(np.median(face[:, 2])) - SPONGE_HEIGHT / 2.0)
    is_of_sponge = np.hypot(points[:, :, 0] - u, points[:, :, 1] - v) <= SPONGE_RADIUS
    other = standing & ~_is_bin(points, opening, BIN_MARGIN) & ~is_of_sponge
    is_empty = int(other.sum()) < MIN_PIXELS
    is_back = dist(sponge, rest) < RETURNED_WITHIN
    return is_empty and is_back and _clean_share(points, rgb, area) >= WIPED_SHARE


def _around(area: Place, corners: Corners) -> Corners:
    """Return corners that count from the middle of the area in the world frame."""
    (x, y, _), ((left, near), (right, far)) = area, corners
    return (x + left, y + near), (x + right, y + far)


def _level(picture: Picture, area: Place) -> tuple[Points, bool]:
    """Return the points of a picture, whose z counts from the table, and True if it shows the table.

    The table is the plane that most points near z = 0 are on: a camera may be tilted a little.
    """
    points = picture.points()
    near = points[_in_rectangle(points, *_around(area, INSPECTED)) & (np.abs(points[:, :, 2]) < FLAT)]
    ground = find_ground(near, OFF_TABLE, MIN_TABLE)
    if ground is not None:
        points[:, :, 2] = heights_above(points, ground)
    return points, ground is not None


def _find_sponge(points: Points, rgb: Points) -> tuple[Rectangle, float] | None:
    """Find the top of the foam and its height: yellow, and as long as a sponge.

    Another yellow thing may lie beside it, and in a bad picture the foam may be in parts.
    """
    z = points[:, :, 2]
    yellow = (z > FOAM_TOPS[0]) & (z < FOAM_TOPS[1]) & _is_yellow(rgb)
    for part in (*separate_parts(yellow, MIN_PIXELS), yellow):
        if int(part.sum()) >= MIN_PIXELS:
            face, top = top_face(points[part])
            if SPONGE_LENGTHS[0] < max(face.length, face.width) < SPONGE_LENGTHS[1]:
                return face, top
    return None


def _middle(sponge: tuple[Rectangle, float]) -> Place:
    face, top = sponge
    return (face.x, face.y, top / 2.0)


def _is_upside_down(face: Rectangle, top: float) -> bool:
    """Return True if a sponge lies on its block: its whole face is up, and higher than foam."""
    return top > UPSIDE_DOWN and min(face.length, face.width) > FACE_WIDTH


def _pieces(points: Points, cores: Mask, mask: Mask) -> Iterator[Piece]:
    """Locate each piece of a mask, whose core has neither its outermost pixels nor what is very thin."""
    for core in separate_parts(cores, MIN_CORE):
        # A core has lost one pixel on each side, and two at corners.
        part = ~erode(erode(~core)) & mask
        piece = points[part]
        top = float(np.median(top_points(piece)[:, 2]))
        box = min_area_rectangle(top_points(piece, top / 2.0)[:, :2])
        shorter, longer = sorted((box.length, box.width))
        yield Piece(piece, (box.x, box.y, top / 2.0), box.longer_heading, (shorter, longer, top))


def _volume(piece: Piece) -> float:
    """Return the volume of the box around a piece, m³."""
    return piece.sides[0] * piece.sides[1] * piece.sides[2]


def _compare(
    seen: list[tuple[Piece, int]], loose: list[Piece]
) -> tuple[list[Piece], list[tuple[Piece, int]]]:
    """Compare the pieces of a picture with those of earlier ones, each with the number of pictures of it.

    Returns the pieces that are gone, of those that more than one picture showed, and the pieces as seen now.
    """
    now = []
    for one in loose:
        times = [number for other, number in seen if dist(one.place, other.place) < SAME_PLACE]
        now.append((one, 1 + max(times, default=0)))
    gone = [
        one
        for one, number in seen
        if number > 1 and all(dist(one.place, other.place) >= SAME_PLACE for other in loose)
    ]
    return gone, now


def _missing_volume(missing: float, lost: float, binned: float, share: float) -> float:
    """Return the volume that is neither on the table nor in the bin.

    It grows by what leaves the table and does not come into the bin; it shrinks by what comes back to the
    table, or comes into the bin otherwise, as from the hand.
    """
    if lost > LEAST_VOLUME:
        return missing if binned > share * lost else missing + lost
    back = max(0.0, -lost) + (binned / share if binned > LEAST_VOLUME else 0.0)
    return max(0.0, missing - back)


def _volume_in_bin(points: Points, opening: Place) -> float:
    """Return the volume below what a picture shows in the bin, m³."""
    floor = opening[2] - BIN_DEPTH
    half = (BIN_HALF[0] - BIN_CELL, BIN_HALF[1] - BIN_CELL)
    low, high = ((opening[0] + s * half[0], opening[1] + s * half[1]) for s in (-1.0, 1.0))
    inside = points[_in_rectangle(points, low, high)]
    heights = inside[:, 2] - floor
    there = inside[(heights > FLAT) & (heights < BIN_DEPTH + GRASPABLE[2])]
    if not len(there):
        return 0.0
    cells = np.unique((there[:, :2] / BIN_CELL).astype(np.intp), axis=0)
    return float(len(cells) * BIN_CELL**2 * np.mean(there[:, 2] - floor))


def _next_piece(loose: list[Piece], area: Place) -> dict[str, Any]:
    """Choose the piece to grip next: one in the way, else the nearest to the arm; none that is too large."""
    fitting = [
        one for one in loose if all(side < most for side, most in zip(one.sides, GRASPABLE, strict=True))
    ]
    if not fitting:
        return {}
    piece = min(fitting, key=lambda one: (not _is_in_the_way(one.points, area), one.place[0]))
    # It is gripped across; where both sides fit, along as well.
    period = pi / 2.0 if piece.sides[1] < GRASPABLE[0] else pi
    return {
        "clutter_position": estimate(piece.place, UNCERTAINTY),
        "clutter_yaw": estimate(wrap_heading(piece.heading, period), HEADING_UNCERTAINTY),
        "clutter_length": estimate(piece.sides[1], UNCERTAINTY),
    }


def _is_yellow(rgb: Points) -> Mask:
    return has_red_ratios(rgb, (YELLOW[0], None), (None, YELLOW[1]), MIN_BRIGHTNESS)


def _stands(points: Points) -> Mask:
    z = points[:, :, 2]
    stands: Mask = (z > STANDING[0]) & (z < STANDING[1])
    return stands


def _is_bin(points: Points, opening: Place, margin: float) -> Mask:
    low, high = (
        (opening[0] + sign * (BIN_HALF[0] + margin), opening[1] + sign * (BIN_HALF[1] + margin))
        for sign in (-1.0, 1.0)
    )
    return _in_rectangle(points, low, high)


def _is_hand(points: Points, tool: Place | None) -> Mask:
    """Find the points of the robot's own hand and of what it holds, if it is over the table."""
    x, y, z = tool or (0.0, 0.0, inf)
    radius, depth = HAND_ROOM
    near = np.hypot(points[:, :, 0] - x, points[:, :, 1] - y) < radius
    hand: Mask = near & (points[:, :, 2] > max(z - depth, HAND_LOWEST))
    return hand


def _is_of_sponge(points: Points, face: Rectangle, top: float) -> Mask:
    """Find the points of the sponge: over foam that lies flat, else around it, as its block is beside."""
    x, y = points[:, :, 0] - face.x, points[:, :, 1] - face.y
    if abs(top - SPONGE_HEIGHT) > FLAT:
        around: Mask = np.hypot(x, y) <= SPONGE_RADIUS
        return around
    c, s = cos(face.heading), sin(face.heading)
    half = (face.length / 2.0 + SPONGE_MARGIN, face.width / 2.0 + SPONGE_MARGIN)
    over: Mask = (np.abs(x * c + y * s) < half[0]) & (np.abs(y * c - x * s) < half[1])
    return over


def _is_in_bin(place: Place, opening: Place) -> bool:
    dx, dy, dz = (a - b for a, b in zip(place, opening, strict=True))
    return abs(dx) < BIN_HALF[0] and abs(dy) < BIN_HALF[1] and -BIN_DEPTH < dz < 0.0


def _is_in_the_way(points: Points, area: Place) -> bool:
    """Return True if some point of a thing is where sponge and fingers pass."""
    corners = np.array(_around(area, AREA))
    low, high = corners[0] - WAY_AROUND, corners[1] + WAY_AROUND
    return bool(((points[:, :2] > low) & (points[:, :2] < high)).all(axis=1).any())


def _in_rectangle(points: Points, low: tuple[float, float], high: tuple[float, float]) -> Mask:
    x, y = points[:, :, 0], points[:, :, 1]
    return (low[0] < x) & (x < high[0]) & (low[1] < y) & (y < high[1])


def _clean_share(points: Points, rgb: Points, area: Place) -> float:
    """Return the share of the area's cells that most of their pixels show as bright as the table around it.

    Cells that the picture does not show do not count as clean.
    """
    low, high = _around(area, AREA)
    red = rgb[:, :, 0]
    top = _in_rectangle(points, *_around(area, INSPECTED)) & (np.abs(points[:, :, 2]) < FLAT)
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
