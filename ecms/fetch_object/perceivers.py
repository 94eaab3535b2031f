"""Perceivers of fetch_object: a red can of known size, found by colour and depth, and felt in the hand.

All lengths in metres, in the world frame; headings are of a hand at yaw 0, whose fingers close along y.
"""

from collections.abc import Mapping
from math import cos, dist, hypot, pi, sin
from typing import Any

import numpy as np

from aeros.perception import (
    Mask,
    Perception,
    Picture,
    Points,
    View,
    estimate,
    has_dominant_colour,
    locate_cylinder,
)

Place = tuple[float, float, float]

RADIUS, HEIGHT = 0.022, 0.08
"""Of the can, m."""

MIN_PIXELS = 25
"""Least number of pixels of the can: fewer are noise, or a can that is mostly hidden."""

RED_DOMINANCE = 2.0
"""Least ratio of red to green and to blue in a red pixel, in any light."""

MIN_BRIGHTNESS = 60
"""Least red of a red pixel (of 255)."""

UNCERTAINTY = 0.005
"""Standard uncertainty of the can's place, m: one and a half pixels of the mast's camera."""

HEADING_UNCERTAINTY = 0.05
"""Standard uncertainty of its heading, rad."""

HAND_HALF = (0.06, 0.115)
"""Half of the space that hand and flange need, along and across the hand's x axis, with 1 cm margin, m."""

HAND_CLEARANCE = 0.02
"""Height of the hand above a gripped object, m; lower objects fit between or next to its fingers."""

PUSH_HALVES = ((0.035, 0.11), (0.046, 0.046))
"""Half of the space that a pushing hand needs, and of its wrist, which may touch objects next to it, m."""

PUSH_START = 0.08
"""Distance behind a can's middle at which fingers come down to push it, m: 40 mm from its end."""

PUSH_ASIDE = (0.0, 0.008, -0.008, 0.016, -0.016, 0.024, -0.024, 0.027, -0.027)
"""Lateral offsets from its axis to try, m: beyond them the fingers miss the end of a can of 22 mm radius."""

SEARCH_STEP = 0.02
"""Spacing of the positions at which free room is searched, m."""

SEARCH_RADIUS = 0.45
"""Greatest distance of those positions from the object, m: more than half of a stand's length."""

GRIP_HEADINGS = (0.0, pi / 2.0)
"""Hand headings to try for a can that stands, rad."""

DELIVERED_WITHIN = 0.03
"""Greatest distance of a delivered can from its place, m."""

GRIPPED_GAP = (0.041, 0.048)
"""Gap between fingers that hold the can, m: it is 44 mm wide, and what stands beside it 40 mm."""

MAX_AGE = 30.0
"""Greatest age of a picture that still says where the can is, s."""

STATION_TO_CAN = 0.58
"""Distance of the can from the arm's base where the base stands to pick it, m."""

REACH = (0.50, 0.70)
"""Horizontal distance from the arm's base at which it can pick objects, m; nearer ones on the floor are
at the carriage."""

REACH_ASIDE = 0.15
"""Greatest lateral offset of an object from the arm's base, m: beyond it the elbow would hit the stand."""

FLOOR = ((-0.6, 0.035), (-1.3, 2.6))
"""Bounds of the arm's base in x and in y, m: the site's `floor`."""

SURVEYED = ("station_survey", "delivery_position")
"""Places of the stands."""

AROUND_STANDS = 0.55
"""Margin around these places, along x and y, within which the can is looked for, m."""

ARRIVED_WITHIN = 0.03
"""Greatest distance of the base from the station at which it has arrived, m."""


def find_can(view: View) -> Perception:
    """Find the can in the newest picture; what a picture does not show keeps the value and time it had.

    Elsewhere in the cell red things are of other tasks. Where the stands are has to be known.
    """
    known: dict[str, Any] = {}
    newest = -1.0
    while True:
        if all(place in view.readings for place in SURVEYED):
            places = [view.readings[place] for place in SURVEYED]
            for name in ("mast", "hand"):
                picture = view.pictures.get(name)
                if picture is None or picture.time <= newest:
                    continue
                for variable, value in _look(picture, name == "mast", *places).items():
                    known[variable] = None if value is None else estimate(*value, time=picture.time)
            newest = max(picture.time for picture in view.pictures.values())
        view = yield known.copy()


def track(view: View) -> Perception:
    """Say if the can is held, and where to drive for it; what was seen before it was held no longer holds."""
    moved_at = -1.0
    while True:
        told = view.readings
        held = _is_held(told)
        if held:
            moved_at = view.time
        seen_at = told.get("object_seen_time", -1.0) if told.get("object_seen") else -1.0
        is_fresh = seen_at > moved_at and view.time - seen_at <= MAX_AGE
        values = {"object_grasped": held, "object_detected": None if held is None else held or is_fresh}
        if "station_survey" in told and "base_position" in told:
            seen = told.get("object_position") if is_fresh else None
            station = _station_for(told["station_survey"], seen)
            values["station_position"] = estimate(station, UNCERTAINTY)
            values["robot_at_target"] = dist(told["base_position"][:2], station[:2]) < ARRIVED_WITHIN
        view = yield values


def _is_held(told: Mapping[str, Any]) -> bool | None:
    if "holding" not in told or "finger_gap" not in told:
        return None
    return bool(told["holding"] and GRIPPED_GAP[0] < told["finger_gap"] < GRIPPED_GAP[1])


def _station_for(surveyed: Place, seen: Place | None) -> Place:
    """Return where the arm's base should be to pick the can.

    It is the surveyed station, unless the can was seen out of reach from there; then the place on the floor
    from which it is in reach.
    """
    if seen is None:
        return surveyed
    away, aside = dist(seen[:2], surveyed[:2]), abs(seen[1] - surveyed[1])
    if REACH[0] <= away <= REACH[1] and aside <= REACH_ASIDE:
        return surveyed
    (west, east), (south, north) = FLOOR
    x, y = seen[0] - STATION_TO_CAN, seen[1]
    return (min(east, max(west, x)), min(north, max(south, y)), surveyed[2])


def _look(
    picture: Picture, is_mast: bool, station: Place, delivery: Place
) -> dict[str, tuple[Any, ...] | None]:
    """Return value and uncertainty of what a picture shows; None for a value that is no longer known.

    Only the mast's camera sees if there is room for a hand around the can, and if it is where it belongs.
    """
    points = picture.points()
    red = has_dominant_colour(picture.rgb, 0, RED_DOMINANCE, MIN_BRIGHTNESS)
    red &= _is_around(points, np.array((station[:2], delivery[:2])))
    if int(red.sum()) < MIN_PIXELS:
        return {"object_seen": (False,), **({"object_delivered": (False,)} if is_mast else {})}
    can = locate_cylinder(points[red], RADIUS, HEIGHT)
    values: dict[str, tuple[Any, ...] | None] = {
        "object_seen": (True,),
        "object_seen_time": (picture.time, 1e-3),
        "object_position": (can.position, UNCERTAINTY),
        "object_lying": (can.axis is not None,),
    }
    if can.axis is not None:
        values["object_yaw"] = (can.axis, HEADING_UNCERTAINTY)
    if not is_mast:
        return values
    # Visible points that a hand would hit.
    higher = points[points[:, :, 2] > can.top + HAND_CLEARANCE]
    headings = GRIP_HEADINGS if can.axis is None else (can.axis,)
    grip = next((way for way in headings if _has_room(higher, can.position, way)), None)
    push = None
    if can.heading is not None and grip is None:
        push = _shortest_push(higher, can.position, can.heading)
    values["object_free"] = (grip is not None,)
    values["object_yaw"] = (can.axis or grip or 0.0, HEADING_UNCERTAINTY)
    values["object_push_start"] = None if push is None else (push[0], UNCERTAINTY)
    values["object_push_way"] = None if push is None else (push[1], UNCERTAINTY)
    dx, dy, dz = (a - b for a, b in zip(can.position, delivery, strict=True))
    rests = RADIUS - HEIGHT / 2 if can.axis is not None else 0.0
    values["object_delivered"] = (hypot(dx, dy) < DELIVERED_WITHIN and abs(dz - rests) < 0.01,)
    return values


def _is_around(points: Points, places: Points) -> Mask:
    """Find the points (h, w, 3) of a picture that are near the rectangle that places (n, 2) span."""
    low, high = places.min(axis=0) - AROUND_STANDS, places.max(axis=0) + AROUND_STANDS
    around: Mask = ((points[:, :, :2] > low) & (points[:, :, :2] < high)).all(axis=2)
    return around


def _has_room(points: Points, place: Place, yaw: float, half: tuple[float, float] = HAND_HALF) -> bool:
    """Return True if none of `points` (n, 3) is where a hand at `yaw` over `place` would be."""
    along, across = np.array((cos(yaw), sin(yaw))), np.array((-sin(yaw), cos(yaw)))
    away = points[:, :2] - np.array(place[:2])
    inside = (np.abs(away @ along) < half[0]) & (np.abs(away @ across) < half[1])
    return not bool(inside.any())


def _shortest_push(points: Points, place: Place, axis: float) -> tuple[Place, Place] | None:
    """Return start and way of the shortest push along `axis` to where a hand has room.

    A hand at the start has room, too. The fingers push as near to the axis as possible.
    """
    x, y, z = place
    for away in np.arange(SEARCH_STEP, SEARCH_RADIUS, SEARCH_STEP).tolist():
        for u, v in ((cos(axis), sin(axis)), (-cos(axis), -sin(axis))):
            if not _has_room(points, (x + away * u, y + away * v, z), axis):
                continue
            for aside in PUSH_ASIDE:
                start = (x - PUSH_START * u - aside * v, y - PUSH_START * v + aside * u, z)
                if all(_has_room(points, start, axis + pi / 2.0, half) for half in PUSH_HALVES):
                    return start, (away * u, away * v, 0.0)
    return None
