"""Perceivers of a table: the sponge by colour and size, what else stands there by depth, dirt by brightness.

All lengths in metres, in the world frame; but heights in a picture count from the table's top, which is the
plane that is fitted to it. A table is level, so a picture in which it slopes is of a tilted camera, and is
levelled first. An object lies on its largest face: the rectangle of least area around its upper half gives
its middle and heading, as its sides are straight.
"""

from collections.abc import Iterator, Mapping
from math import cos, dist, inf, pi, sin
from typing import Any, NamedTuple

import numpy as np

from aeros.perception import (
    CameraError,
    Level,
    Mask,
    Perception,
    Picture,
    Points,
    Rectangle,
    View,
    believe_height,
    correct_points,
    erode,
    estimate,
    find_level_disc,
    fit_camera_error,
    has_red_ratios,
    heap_volume,
    largest_gap,
    level_ground,
    min_area_rectangle,
    seen_cells,
    separate_parts,
    top_points,
    wrap_heading,
)

Place = tuple[float, float, float]
Corners = tuple[tuple[float, float], tuple[float, float]]

AREA = ((-0.15, -0.15), (0.15, 0.15))
"""Lowest and highest corner (x, y) of the area to wipe, from its middle, m."""

REGIONS = {"whole": (-inf, inf), "left": (0.0, inf), "right": (-inf, 0.0)}
"""Bounds of each region that an instruction may say, along y from the middle of the area to wipe, m."""

CELL = 0.01
"""Edge of a cell in which dirt is judged, m."""

WIPED_SHARE = 0.95
"""Least share of clean cells of a wiped area."""

DIRT_BRIGHTNESS = 0.7
"""Share of the bare table's brightness below which a pixel shows dirt."""

WAY_AROUND = 0.04
"""Distance from the area within which sponge and fingers pass, m."""

HAND_AROUND, HAND_FROM = 0.14, 0.07
"""Distance from the area, along y, within which the hand passes, m, and the height of its underside with a
margin, m."""

FLAT = 0.012
"""Greatest height of the table's own points, m: depth is some millimetres off."""

NEAR_TABLE = 0.06
"""Greatest height over the surveyed table of a point that the table is fitted to, m: a camera that is tilted
by 1° has it 10 mm off at the ends, and the table may be some 20 mm higher or lower."""

OFF_TABLE = 0.004
"""Greatest distance from its plane of such a point, m: the bin's floor is 5 mm up."""

WRIST_DISC, WRIST_RADIUS = (-0.0075, 0.0, 0.287), 0.035
"""Middle of the level cap of the wrist, from the tool point of a hand that points down at yaw 0, and its
radius, m: it shows from above where the robot's own hand is."""

WRIST_WITHIN = 0.05
"""Greatest distance of that cap in a picture from where it is, m."""

OWN_HAND_OFF = 0.010
"""Distance of the robot's own hand in a picture from where it is above which the camera is off, m: 3 mm are
of the picture."""

TILTED = 0.005
"""Tilt of a camera above which it is off, rad: pixels and noise make 0.0015 rad."""

CALIBRATED_WITHIN = 0.005
"""Greatest error of the table's height in a picture whose camera's error is known, m."""

NEW_PLACE = 0.05
"""Distance of two places of the hand that tell more than one, m."""

PLACES = 12
"""Number of places of the hand that are remembered; the oldest is forgotten first."""

TRUSTED_RESIDUAL = 0.005
"""Greatest residual of a camera's error, m: one with more is not applied."""

UNNOTICED = 0.012
"""Greatest displacement of a camera that nobody notices, m: a table that is seen higher or lower by more
is."""

FOAM_TOPS = (FLAT, 0.12)
"""Height range of the sponge's foam, m, however it lies."""

STANDING = (FLAT, 0.30)
"""Height range of anything that stands on the table, m: above is the arm."""

INSPECTED = ((-0.20, -0.62), (0.25, 0.50))
"""Lowest and highest corner (x, y) of the inspected area, from the middle of the area to wipe, m: all of the
table that the arm works on."""

COVERED = ((-0.18, -0.62), (0.25, 0.50))
"""The part of it that is surely table, and not its front edge."""

SEEN_CELL, HIDING_CELLS = 0.02, 4
"""Edge of a cell that a picture shows or not, m, and the number of cells in which a piece can hide."""

BIN_SHADOW = 0.06
"""What the bin's walls hide around it, m."""

VOLUME_CELL = 0.005
"""Edge of a cell in which the height of clutter is taken, m: a pixel is 4 mm."""

MISSING_SHARE = 0.6
"""Share of the smallest piece's volume by which clutter must have become less for a piece to be missing:
volumes are seen to a quarter, and walls hide some."""

LEAST_LACK = 0.2
"""The same as a share of all clutter, so that a speck that was once seen is not missed."""

NEEDED = ("area_position", "bin_position", "sponge_rest_position", "region")
"""Readings that a verdict needs."""

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
"""Bounds on the longer side of the sponge's top, m: it is 100 mm, and 70 mm where it stands on its end; a
smaller sponge (15 %) or a larger one (20 %) is as good."""

FOAM_TOP_SHARE, FOAM_TOP_WITHIN = 80.0, 0.008
"""Percentile of the heights of foam that is on its upper side, as seen from above, and the noise of that
height, m."""

SPONGE_HEIGHT = 0.03
"""Height of the sponge's foam, m."""

BLOCK_OVER, BLOCK_PIXELS = 0.02, 20
"""Least height of a block on top of the foam above the foam's top, m, and its least number of pixels: the
sponge's is 34 mm and some 120 pixels."""

OVERTURNED_FROM = 0.045
"""Height of the foam's top from which a sponge without its block on top lies on another face, m: on its side
it is 75 mm high, upside down 64 mm."""

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

HAND_ROOM = (0.15, 0.05)
"""Radius around the tool, and depth below it, of the hand and of what it holds, m."""

HAND_LOWEST = 0.12
"""Height below which the hand counts as something in the way, m: it hides what is there."""

FLOOR_AROUND, FLOOR_BELOW = ((-0.70, -1.30), (0.90, 1.10)), 0.15
"""Lowest and highest corner (x, y) of the floor that is looked over for what fell, from the middle of the
area to wipe, and its least depth below the table, m."""

FALLEN_HEIGHT, FALLEN_LENGTH = 0.15, 0.17
"""Greatest height and length of what fell, m."""

CARRIAGE = (0.32, 0.30)
"""Half the length and width of what the arm stands on, with a margin, m."""

GRASPABLE = (0.065, 0.15, 0.095)
"""Greatest shorter side, longer side and height of a piece, or of a heap, that the hand can grip, m."""

HEAP_HEIGHT, HEAP_GRASP = 0.065, 0.035
"""Height above which a piece is gripped near its top, m, as it may be a heap, and depth of that grasp, m: the
upper piece comes first, and a single one hangs no lower than what may be held."""

UNCERTAINTY = 0.005
"""Standard uncertainty of a place, m: a pixel is 4 mm."""

HEADING_UNCERTAINTY = 0.05
"""Standard uncertainty of a heading, rad."""


class HandExtent(NamedTuple):
    """A part of the open hand, on both sides of the tool point.

    Attributes:
        thick: extent along the hand's heading, m.
        wide: nearest and farthest distance from the tool point along the way of the fingers, m.
        from_height: height of its lower end over the tool point, m.
    """

    thick: float
    wide: tuple[float, float]
    from_height: float


OPEN_HAND = (HandExtent(0.035, (0.0, 0.105), 0.034), HandExtent(0.013, (0.036, 0.064), -0.009))
"""Palm and fingers, 80 mm apart; with some millimetres to spare."""

IN_THE_WAY = 4
"""Number of points from which something is in the hand's way: fewer are noise."""


class OwnHand(NamedTuple):
    """The robot's own hand in pictures: seen and known places, and the camera's error that they show.

    `base` is the arm's base meanwhile. `is_off` if the last picture shows the hand where it is not, and so
    all else, too.
    """

    base: Place | None
    places: list[tuple[Place, Place]]
    error: CameraError | None
    is_off: bool


class Clutter(NamedTuple):
    """All clutter: volumes of it that were seen, m³, and where pieces were.

    `most` is the greatest volume that two pictures in a row have shown, `last` that of the last picture, or
    0, and `smallest` the smallest piece's. `places` are those of the last picture that showed loose pieces.
    `is_missing` if a piece has vanished; None if one picture alone says so.
    """

    most: float
    last: float
    smallest: float
    places: tuple[Place, ...]
    is_missing: bool | None


class Piece(NamedTuple):
    """A thing on the table that is neither the sponge nor the hand.

    Attributes:
        points: its points (n, 3), m; z counts from the table.
        place: its middle at half its height, or near the top of a high one, m.
        heading: of its longer side, rad.
        sides: shorter side, longer side and height, m.
    """

    points: Points
    place: Place
    heading: float
    sides: tuple[float, float, float]


def see_table(view: View) -> Perception:
    """Find sponge, clutter and dirt in a picture from above; without the table in it, clutter is unknown.

    The robot's own hand shows in the pictures how far off the camera is: what is seen is corrected by that.
    """
    hand = OwnHand(None, [], None, is_off=False)
    clutter = Clutter(0.0, 0.0, 0.0, (), is_missing=False)
    while True:
        picture, readings = view.pictures["overhead"], view.readings
        if "area_position" not in readings or "region" not in readings:
            view = yield {}
            continue
        area, region = readings["area_position"], readings["region"]
        level = _level(picture, area)
        if level is not None:
            hand = _watch(hand, level, readings)
        points, table = _above_table(picture, level, area, hand.error)
        rgb = picture.rgb.astype(np.float64)
        sponge = _find_sponge(points, rgb)
        values: dict[str, Any] = {"sponge_seen": sponge is not None, **_camera_values(hand)}
        values["sponge_overturned"] = sponge is not None and _is_overturned(points, *sponge)
        if table is not None:
            values["table_lift"] = estimate(table - area[2], UNCERTAINTY)
        top = area[2] if table is None else table
        if sponge is not None:
            values["sponge_position"] = estimate(_lifted(_middle(sponge), top), UNCERTAINTY)
            values["sponge_top"] = estimate(sponge[1], UNCERTAINTY)
            values["sponge_yaw"] = estimate(wrap_heading(sponge[0].longer_heading, pi), HEADING_UNCERTAINTY)
        clean, unseen = _clean_share(points, rgb, area, region)
        values["wiped_fraction"] = estimate(clean, 0.01)
        values["table_wiped"] = _is_wiped(clean, unseen)
        if table is not None and "bin_position" in readings:
            opening = _lifted(readings["bin_position"], -area[2])
            other = _in_rectangle(points, *_around(area, INSPECTED)) & _stands(points)
            other &= ~_is_bin(points, opening, BIN_EDGE)
            other &= ~_is_hand(points, readings.get("tool_position"))
            if sponge is not None:
                other &= ~_is_of_sponge(points, *sponge)
            else:
                # It may be the sponge, although the picture does not show that; then nothing is tidy.
                other &= ~_is_yellow(rgb)
            pieces = [
                one for one in _pieces(points, erode(other), other) if not _is_in_bin(one.place, opening)
            ]
            inspected = _around(area, _part(INSPECTED, region))
            loose = [one for one in pieces if _reaches(one.points, inspected)]
            # Another answer than "yes, there is something" needs a look at all of the region.
            shown = points[_stands_or_lies(points) & ~_is_hand(points, readings.get("tool_position"))]
            surroundings = [_bin_surroundings(opening)]
            covered = _is_covered(shown, area, _part(COVERED, region), surroundings)
            values["clutter_on_table"] = True if loose else (False if covered else None)
            is_blocked = any(
                _is_in_the_way(points[part], area, region) for part in separate_parts(other, MIN_PIXELS)
            )
            is_way_seen = _is_covered(shown, area, _passed(region), [])
            values["wiping_area_clear"] = False if is_blocked else (True if is_way_seen else None)
            around = [one.points for one in pieces]
            if sponge is not None:
                around.append(points[_is_of_sponge(points, *sponge) & _stands(points)])
            values |= _next_piece(loose, around, area, region, top)
            # A piece can have gone from one half to the other, so all of the table counts.
            is_all_seen = covered and _is_covered(shown, area, COVERED, surroundings)
            if is_all_seen and sponge is not None and readings.get("holding") is False:
                inside = points[_is_bin(points, opening, -BIN_EDGE) & _stands(points)]
                clutter = _count(clutter, pieces, inside, top)
                values |= _missing_values(clutter)
            else:
                clutter = Clutter(clutter.most, 0.0, clutter.smallest, clutter.places, clutter.is_missing)
            if "sponge_rest_position" in readings:
                rest = _lifted(readings["sponge_rest_position"], -area[2])
                is_back = sponge is not None and dist(_middle(sponge), rest) < RETURNED_WITHIN
                is_tidy = not loose and is_back and clutter.is_missing is not True
                is_known = covered and clutter.is_missing is not None
                values["table_organized"] = is_tidy if is_known or not is_tidy else None
        view = yield values


def check_table(view: View) -> Perception:
    """Judge a picture from the mast: the region is clean, the sponge at its rest, and nothing else is there.

    It is a second opinion: what other pictures showed is not used, but those of the robot's own hand.
    """
    hand = OwnHand(None, [], None, is_off=False)
    while True:
        picture, readings = view.pictures["mast"], view.readings
        is_clean: bool | None = None
        if all(name in readings for name in NEEDED):
            area, opening, rest, region = (readings[name] for name in NEEDED)
            level = _level(picture, area)
            if level is not None:
                hand = _watch(hand, level, readings)
            points, _ = _above_table(picture, level, area, hand.error)
            opening, rest = _lifted(opening, -area[2]), _lifted(rest, -area[2])
            is_clean = _is_clean(points, picture.rgb.astype(np.float64), (area, opening, rest), region)
        view = yield {"table_verified": is_clean}


def see_floor(view: View) -> Perception:
    """Find the sponge, or a piece that is missed, on the floor around the table, where no arm reaches.

    What a picture has shown there counts until the table has it again.
    """
    seen: dict[str, float] = {}
    fallen: dict[str, Place] = {}
    while True:
        readings = view.readings
        for name, picture in view.pictures.items():
            if "area_position" not in readings or "base_position" not in readings:
                continue
            if picture.time > seen.get(name, -1.0):
                seen[name] = picture.time
                fallen |= _find_on_floor(picture, readings["area_position"], readings["base_position"])
        if readings.get("sponge_seen") is not False:
            fallen.pop("sponge", None)
        if readings.get("clutter_missing") is not True:
            fallen.pop("piece", None)
        values: dict[str, Any] = {}
        for thing in ("sponge", "piece"):
            values[f"{thing}_on_floor"] = thing in fallen
            if thing in fallen:
                values[f"{thing}_floor_position"] = estimate(fallen[thing], UNCERTAINTY)
        view = yield values


def _find_on_floor(picture: Picture, area: Place, base: Place) -> dict[str, Place]:
    """Find what lies on the floor: small, flat, and not at what the arm stands on."""
    points = picture.points()
    below = _in_rectangle(points, *_around(area, FLOOR_AROUND)) & (points[:, :, 2] < area[2] - FLOOR_BELOW)
    if int(below.sum()) < MIN_TABLE:
        return {}
    floor = float(np.median(points[below][:, 2]))
    x, y = np.abs(points[:, :, 0] - base[0]), np.abs(points[:, :, 1] - base[1])
    above = points[:, :, 2] - floor
    lies = below & (above > STANDING[0]) & (above < FALLEN_HEIGHT) & ((x > CARRIAGE[0]) | (y > CARRIAGE[1]))
    yellow = _is_yellow(picture.rgb.astype(np.float64))
    found: dict[str, Place] = {}
    for part in separate_parts(lies, MIN_PIXELS):
        box = min_area_rectangle(points[part][:, :2])
        if max(box.length, box.width) > FALLEN_LENGTH:
            continue
        is_sponge = bool(2 * int((part & yellow).sum()) > int(part.sum()))
        found["sponge" if is_sponge else "piece"] = (box.x, box.y, floor)
    return found


def _is_clean(points: Points, rgb: Points, places: tuple[Place, Place, Place], region: str) -> bool | None:
    """Judge a picture whose heights count from the table.

    It is None if all that the picture shows of the region is clean, and that is not all of it.
    """
    area, opening, rest = places
    standing = _in_rectangle(points, *_around(area, INSPECTED)) & _stands(points)
    foam = points[standing & _is_yellow(rgb)]
    if len(foam) < MIN_PIXELS:
        return False
    face = top_points(foam)
    u, v = ((face[:, :2].min(axis=0) + face[:, :2].max(axis=0)) / 2.0).tolist()
    sponge = (u, v, float(np.median(face[:, 2])) - SPONGE_HEIGHT / 2.0)
    is_of_sponge = np.hypot(points[:, :, 0] - u, points[:, :, 1] - v) <= SPONGE_RADIUS
    other = standing & _in_rectangle(points, *_around(area, _part(INSPECTED, region)))
    other &= ~_is_bin(points, opening, BIN_MARGIN) & ~is_of_sponge
    is_empty = int(other.sum()) < MIN_PIXELS
    is_back = dist(sponge, rest) < RETURNED_WITHIN
    wiped = _is_wiped(*_clean_share(points, rgb, area, region))
    if not (is_empty and is_back) or wiped is False:
        return False
    around = ((u - SPONGE_RADIUS, v - SPONGE_RADIUS), (u + SPONGE_RADIUS, v + SPONGE_RADIUS))
    shown = points[_stands_or_lies(points)]
    is_covered = _is_covered(shown, area, _part(COVERED, region), [_bin_surroundings(opening), around])
    return wiped if is_covered else None


def _is_wiped(clean: float, unseen: float) -> bool | None:
    """Judge the shares of clean and of unseen cells; None if it depends on the unseen ones."""
    if clean >= WIPED_SHARE:
        return True
    return None if clean + unseen >= WIPED_SHARE else False


def _stands_or_lies(points: Points) -> Mask:
    """Find the points that show what is on the table at a place, or that nothing is."""
    z = points[:, :, 2]
    tells: Mask = (z > -FLAT) & (z < STANDING[1])
    return tells


def _is_covered(shown: Points, area: Place, corners: Corners, known: list[Corners]) -> bool:
    """Return True if no object fits in what is not shown of a rectangle, but for places that are known."""
    low, high = _around(area, corners)
    seen = seen_cells(shown, low, high, SEEN_CELL)
    columns, rows = seen.shape
    x = low[0] + (np.arange(columns) + 0.5) * SEEN_CELL
    y = low[1] + (np.arange(rows) + 0.5) * SEEN_CELL
    for (left, near), (right, far) in known:
        seen |= ((x > left) & (x < right))[:, None] & ((y > near) & (y < far))[None, :]
    return largest_gap(seen) < HIDING_CELLS


def _passed(region: str) -> Corners:
    """Return the corners of where sponge and fingers pass, from the middle of the area."""
    (left, near), (right, far) = _part(AREA, region)
    return (left - WAY_AROUND, near - WAY_AROUND), (right + WAY_AROUND, far + WAY_AROUND)


def _bin_surroundings(opening: Place) -> Corners:
    """Return the corners of the bin, and of what its walls hide."""
    x, y, _ = opening
    u, v = BIN_HALF[0] + BIN_SHADOW, BIN_HALF[1] + BIN_SHADOW
    return (x - u, y - v), (x + u, y + v)


def _count(before: Clutter, loose: list[Piece], inside: Points, table: float) -> Clutter:
    """Compare the volume of all clutter, loose and in the bin, with the most that there was.

    Pieces in the bin lie on each other, so they are counted by volume.
    """
    volumes = [heap_volume(one.points, VOLUME_CELL) for one in loose]
    now = sum(volumes) + heap_volume(inside, VOLUME_CELL)
    most = max(before.most, min(before.last, now))
    smallest = min([before.smallest or inf, *volumes])
    places = tuple(_lifted(one.place, table) for one in loose)
    lack = 0.0 if smallest == inf else max(MISSING_SHARE * smallest, LEAST_LACK * most)
    is_less: bool | None = smallest < inf and now < most - lack
    if is_less and before.is_missing is False:
        is_less = None
    return Clutter(most, now, 0.0 if smallest == inf else smallest, places or before.places, is_less)


def _missing_values(clutter: Clutter) -> dict[str, Any]:
    """Return whether a piece has vanished, and where the last one was seen."""
    values: dict[str, Any] = {"clutter_missing": clutter.is_missing}
    if clutter.is_missing and clutter.places:
        values["clutter_last_seen"] = estimate(clutter.places[0], UNCERTAINTY)
    return values


def _part(corners: Corners, region: str) -> Corners:
    """Return the part of a rectangle, in metres from the middle of the area, that a region covers."""
    ((left, near), (right, far)), (low, high) = corners, REGIONS[region]
    return (left, max(near, low)), (right, min(far, high))


def _reaches(points: Points, corners: Corners) -> bool:
    """Return True if some point (n, 3) is over a rectangle."""
    low, high = np.array(corners)
    return bool(((points[:, :2] > low) & (points[:, :2] < high)).all(axis=1).any())


def _around(area: Place, corners: Corners) -> Corners:
    """Return corners that count from the middle of the area in the world frame."""
    (x, y, _), ((left, near), (right, far)) = area, corners
    return (x + left, y + near), (x + right, y + far)


def _lifted(place: Place, height: float) -> Place:
    return (place[0], place[1], place[2] + height)


def _level(picture: Picture, area: Place) -> Level | None:
    """Turn the camera until the table is level; None if the picture shows no table."""
    points = picture.points()
    near = _in_rectangle(points, *_around(area, INSPECTED))
    return level_ground(
        picture, near & (np.abs(points[:, :, 2] - area[2]) < NEAR_TABLE), OFF_TABLE, MIN_TABLE
    )


def _above_table(
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


def _watch(hand: OwnHand, level: Level, readings: Mapping[str, Any]) -> OwnHand:
    """Note where a level picture shows the robot's own hand, and where it is.

    What was seen before the base drove no longer holds. An error of the camera is fitted whenever the hand
    was seen at places enough. A camera is off, too, if it is tilted and no error of it is known: what has
    tilted it may have moved it.
    """
    if "tool_position" not in readings or "base_position" not in readings:
        return hand
    base, known = readings["base_position"], _moved(readings["tool_position"], WRIST_DISC)
    if hand.base is None or dist(hand.base, base) > NEW_PLACE:
        hand = OwnHand(base, [], None, is_off=False)
    is_tilted = level.tilt > TILTED and hand.error is None
    seen = find_level_disc(level.points, known, WRIST_RADIUS, WRIST_WITHIN)
    if seen is None:
        return OwnHand(base, hand.places, hand.error, is_off=hand.is_off or is_tilted)
    others = [one for one in hand.places if dist(one[1], known) > NEW_PLACE]
    places = [*others, (seen, known)][-PLACES:]
    error = fit_camera_error([one[0] for one in places], [one[1] for one in places])
    if error is not None and error.residual > TRUSTED_RESIDUAL:
        error = None
    if error is None:
        return OwnHand(base, places, None, is_off=is_tilted or dist(seen, known) > OWN_HAND_OFF)
    x, y, z = correct_points(np.array(seen), error.turn, error.shift).tolist()
    return OwnHand(base, places, error, is_off=dist((x, y, z), known) > OWN_HAND_OFF)


def _moved(place: Place, by: Place) -> Place:
    return (place[0] + by[0], place[1] + by[1], place[2] + by[2])


def _camera_values(hand: OwnHand) -> dict[str, Any]:
    """Return what is known of the camera's error."""
    values: dict[str, Any] = {"overhead_off": hand.is_off}
    if hand.error is not None:
        values["overhead_turn"] = estimate(hand.error.turn, 0.01)
        values["overhead_shift"] = estimate(hand.error.shift, hand.error.residual)
        values["overhead_residual"] = estimate(hand.error.residual, 0.001)
    return values


def _find_sponge(points: Points, rgb: Points) -> tuple[Rectangle, float] | None:
    """Find the top of the foam and its height: yellow, and as long as a sponge.

    Another yellow thing may lie beside it, and in a bad picture the foam may be in parts.
    """
    z = points[:, :, 2]
    yellow = (z > FOAM_TOPS[0]) & (z < FOAM_TOPS[1]) & _is_yellow(rgb)
    for part in (*separate_parts(yellow, MIN_PIXELS), yellow):
        if int(part.sum()) >= MIN_PIXELS:
            face, top = _foam_face(points[part])
            if SPONGE_LENGTHS[0] < max(face.length, face.width) < SPONGE_LENGTHS[1]:
                return face, top
    return None


def _foam_face(points: Points) -> tuple[Rectangle, float]:
    """Return the rectangle around the foam's upper side, and its height, whatever single points are."""
    top = float(np.percentile(points[:, 2], FOAM_TOP_SHARE))
    face = points[np.abs(points[:, 2] - top) < FOAM_TOP_WITHIN]
    return min_area_rectangle(face[:, :2]), float(np.median(face[:, 2]))


def _middle(sponge: tuple[Rectangle, float]) -> Place:
    """Return the foam's middle: half-way up on the table, else as far below its top as when it lies flat."""
    face, top = sponge
    return (face.x, face.y, top / 2.0 if top < OVERTURNED_FROM else top - SPONGE_HEIGHT / 2.0)


def _is_overturned(points: Points, face: Rectangle, top: float) -> bool:
    """Return True if the foam is higher than on the table, and no block is on top of it."""
    over = _inside(points, face, 0.0) & (points[:, :, 2] > top + BLOCK_OVER)
    return top > OVERTURNED_FROM and int((over & _stands(points)).sum()) < BLOCK_PIXELS


def _pieces(points: Points, cores: Mask, mask: Mask) -> Iterator[Piece]:
    """Locate each piece of a mask, whose core has neither its outermost pixels nor what is very thin."""
    for core in separate_parts(cores, MIN_CORE):
        # A core has lost one pixel on each side, and two at corners.
        part = ~erode(erode(~core)) & mask
        piece = points[part]
        top = float(np.median(top_points(piece)[:, 2]))
        box = min_area_rectangle(top_points(piece, top / 2.0)[:, :2])
        shorter, longer = sorted((box.length, box.width))
        middle = top / 2.0 if top < HEAP_HEIGHT else top - HEAP_GRASP
        yield Piece(piece, (box.x, box.y, middle), box.longer_heading, (shorter, longer, top))


def _next_piece(
    loose: list[Piece], around: list[Points], area: Place, region: str, table: float
) -> dict[str, Any]:
    """Choose the piece to grip next, and its heading: none that is too large.

    One with room for the hand comes first, then one in the way, then the nearest to the arm.

    Args:
        loose: the pieces to choose from.
        around: points of each thing on the table, those of the pieces among them.
        area: middle of the area to wipe.
        region: the part of the table to clean.
        table: height of the table, m.
    """
    fitting = [
        one for one in loose if all(side < most for side, most in zip(one.sides, GRASPABLE, strict=True))
    ]
    if not fitting:
        return {}
    fitting.sort(key=lambda one: (not _is_in_the_way(one.points, area, region), one.place[0]))
    found = ((one, heading) for one in fitting if (heading := _heading_with_room(one, around)) is not None)
    piece, heading = next(found, (fitting[0], _headings(fitting[0])[0]))
    return {
        "clutter_position": estimate(_lifted(piece.place, table), UNCERTAINTY),
        "clutter_yaw": estimate(heading, HEADING_UNCERTAINTY),
        "clutter_length": estimate(piece.sides[1], UNCERTAINTY),
    }


def _headings(piece: Piece) -> tuple[float, ...]:
    """Return the headings to grip a piece at: across, and along as well where both sides fit."""
    if piece.sides[1] >= GRASPABLE[0]:
        return (wrap_heading(piece.heading, pi),)
    first = wrap_heading(piece.heading, pi / 2.0)
    return (first, wrap_heading(first + pi / 2.0, pi))


def _heading_with_room(piece: Piece, around: list[Points]) -> float | None:
    """Return the first heading at which an open hand meets no other thing; None if there is none."""
    others = [one for one in around if one is not piece.points]
    points = np.concatenate([np.empty((0, 3)), *others])
    return next((one for one in _headings(piece) if _has_room(points, piece.place, one)), None)


def _has_room(points: Points, place: Place, yaw: float) -> bool:
    """Return True if an open hand at a place and heading meets none of the points.

    Args:
        points: points of all other things, (n, 3), in the frame of `place`, m.
        place: of the tool, m.
        yaw: heading of the hand, rad; the fingers close across it.
    """
    x, y, z = place
    away = points[:, :2] - np.array((x, y))
    along = np.abs(away @ np.array((cos(yaw), sin(yaw))))
    across = np.abs(away @ np.array((-sin(yaw), cos(yaw))))
    above = points[:, 2] - z
    return not any(
        np.count_nonzero(
            (along < part.thick)
            & (across >= part.wide[0])
            & (across < part.wide[1])
            & (above > part.from_height)
        )
        >= IN_THE_WAY
        for part in OPEN_HAND
    )


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
    if abs(top - SPONGE_HEIGHT) > FLAT:
        x, y = points[:, :, 0] - face.x, points[:, :, 1] - face.y
        around: Mask = np.hypot(x, y) <= SPONGE_RADIUS
        return around
    return _inside(points, face, SPONGE_MARGIN)


def _inside(points: Points, face: Rectangle, margin: float) -> Mask:
    """Find the points over a rectangle with a margin around it."""
    x, y = points[:, :, 0] - face.x, points[:, :, 1] - face.y
    c, s = cos(face.heading), sin(face.heading)
    half = (face.length / 2.0 + margin, face.width / 2.0 + margin)
    over: Mask = (np.abs(x * c + y * s) < half[0]) & (np.abs(y * c - x * s) < half[1])
    return over


def _is_in_bin(place: Place, opening: Place) -> bool:
    dx, dy, dz = (a - b for a, b in zip(place, opening, strict=True))
    return abs(dx) < BIN_HALF[0] and abs(dy) < BIN_HALF[1] and -BIN_DEPTH < dz < 0.0


def _is_in_the_way(points: Points, area: Place, region: str) -> bool:
    """Return True if a thing is where sponge and fingers pass, or as high as the hand where that passes."""
    (left, near), (right, far) = _around(area, _part(AREA, region))
    around = (left - WAY_AROUND, near - WAY_AROUND), (right + WAY_AROUND, far + WAY_AROUND)
    beside = (left - WAY_AROUND, near - HAND_AROUND), (right + WAY_AROUND, far + HAND_AROUND)
    return _reaches(points, around) or _reaches(points[points[:, 2] > HAND_FROM], beside)


def _in_rectangle(points: Points, low: tuple[float, float], high: tuple[float, float]) -> Mask:
    x, y = points[:, :, 0], points[:, :, 1]
    return (low[0] < x) & (x < high[0]) & (low[1] < y) & (y < high[1])


def _clean_share(points: Points, rgb: Points, area: Place, region: str) -> tuple[float, float]:
    """Return the shares of the region's cells that are clean, and that the picture does not show.

    Most pixels of a clean cell are as bright as the table around the whole area.
    """
    low, high = _around(area, _part(AREA, region))
    red = rgb[:, :, 0]
    top = _in_rectangle(points, *_around(area, INSPECTED)) & (np.abs(points[:, :, 2]) < FLAT)
    inside = top & _in_rectangle(points, low, high)
    outside = top & ~_in_rectangle(points, *_around(area, AREA))
    if not outside.any():
        return 0.0, 1.0
    bright = red > DIRT_BRIGHTNESS * np.median(red[outside])
    columns, rows = (round((b - a) / CELL) for a, b in zip(low, high, strict=True))
    cells = ((points[inside][:, :2] - np.array(low)) / CELL).astype(np.intp)
    cell = np.clip(cells[:, 1], 0, rows - 1) * columns + np.clip(cells[:, 0], 0, columns - 1)
    seen = np.bincount(cell, minlength=rows * columns)
    bright_ones = np.bincount(cell, weights=bright[inside], minlength=rows * columns)
    return float((bright_ones * 2.0 > seen).mean()), float((seen == 0).mean())
