"""Perceivers of fetch_object: an object of known size, found by colour and depth, and felt in the hand.

The instruction names the object; the site says its shape, size and colour.

All lengths in metres, in the world frame; headings are of a hand at yaw 0, whose fingers close along y.
"""

from collections.abc import Mapping
from math import atan2, cos, dist, hypot, pi, sin
from typing import Any, NamedTuple

import numpy as np

from aeros.perception import (
    Mask,
    Perception,
    Picture,
    Points,
    View,
    believe_height,
    erode,
    estimate,
    has_colour_of,
    is_lit_for,
    locate_box,
    locate_cylinder,
    min_area_rectangle,
    separate_parts,
    upper_points,
    wrap_heading,
)

from .parts import LARGEST_SCALE, MIN_PIXELS, parts_of
from .pushes import push_length
from .search import NOTHING, Search
from .sizes import fits_hand, grip_height
from .slips import NO_SLIP, SLIPS_OUT, slips_with
from .stations import STATION_TO_OBJECT, WESTMOST, base_from

Place = tuple[float, float, float]

MIN_FROM_ABOVE = 5
"""The same in a picture of the camera over the aisle, 14 mm a pixel."""

FLOOR_BELOW, ON_FLOOR = 0.30, (0.015, 0.04)
"""Depth of the floor below the arm's base, least height over it of points of an object, and how much farther
up than the object they may seem to be, m."""

SHOWN_WITHIN = 0.06
"""Greatest distance from a place of a point that a picture shows of what is there, m."""

MIN_HIT = 4
"""Least number of pixels of something that the forearm, or a finger, would hit."""

GREYISH = 0.15
"""Saturation below which a colour has no hue: such an object is told by its brightness."""

WHOLE, DARK_RIM = 0.7, 0.15
"""Size of a part of a picture over that of the object below which it may be a part of it, and least share
of its rim that is dark if the rest is in the dark."""

CARRIAGE_RADIUS, FLOOR_DEPTH = 0.35, 0.28
"""Radius of the carriage around the arm's base, and depth below it of what is on the floor, m."""

HAND_RADIUS, HAND_ABOVE = 0.22, 0.02
"""Radius around the tool within which the arm is, from that depth below it on, m."""

STILL_WITHIN = 0.05
"""Greatest distance of two places of an object that lies still, m: pictures differ."""

UNCERTAINTY = 0.005
"""Standard uncertainty of the object's place, m: one and a half pixels of the mast's camera."""

HEADING_UNCERTAINTY = 0.05
"""Standard uncertainty of its heading, rad."""

HAND_HALF = (0.06, 0.115)
"""Half of the space that hand and flange need, along and across the hand's x axis, with 1 cm margin, m."""

FINGER_HALF, FINGERS_ACROSS = 0.014, (0.036, 0.062)
"""Half of a fingertip's width along the hand's x axis, and its extent across it, of a hand that is open, with
3 and 5 mm margin, m."""

HAND_CLEARANCE = 0.02
"""Height of the hand above a gripped object, m; lower objects fit between or next to its fingers."""

FOREARM_AWAY, FOREARM_ASIDE, FOREARM_ABOVE = (-0.22, -0.045), (-0.075, 0.135), 0.16
"""The forearm of a hand that grips: its extent away from the arm's base, beyond the grip; its extent to the
left of the grip; and its least height over the grip, m. It is wider to the left."""

ASIDES = (0.0, -0.10, 0.10, -0.17, 0.17, -0.25, 0.25)
"""Distances to the left of an object at which the base may stand to grip it, in the order of trial, m."""

PUSH_HALVES = ((0.035, 0.11), (0.046, 0.046))
"""Half of the space that a pushing hand needs, and of its wrist, which may touch objects next to it, m."""

PUSH_START = 0.04
"""Distance behind a can's end at which fingers come down to push it, m."""

PUSH_ASIDE = ((0.0, 0.008, -0.008, 0.016, -0.016, 0.024, -0.024, 0.025, -0.025), (0.027, -0.027))
"""Lateral offsets from its axis, at its end, to try, m: at the last ones, which are tried if no other push
has room, the fingers may slip off the end of a can of 22 mm radius."""

PUSH_ASKEW = (0.0, 0.12, -0.12, 0.24, -0.24)
"""Angles between the object and the way that it is pushed to try, rad: what it lies against guides it."""

SEARCH_STEP = 0.02
"""Spacing of the positions at which free room is searched, m."""

SEARCH_RADIUS = 0.45
"""Greatest distance of those positions from the object, m: more than half of a stand's length."""

GRIPS_ALONG = (0.0, 0.008, -0.008, 0.014, -0.014, 0.02, -0.02)
"""Distances from the middle of a cylinder that lies at which a hand may grip it, along its axis, m: at a
quarter of its length from its end the fingers still hold it level, and it is delivered within 30 mm."""

PUSH_SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Places on the way of a pushing hand that need room, as shares of it: they are at most 60 mm apart."""

GRIP_HEADINGS = (0.0, pi / 2.0)
"""Hand headings to try for a cylinder that stands, rad."""

DELIVERED_WITHIN = 0.03 - UNCERTAINTY
"""Greatest distance at which a picture shows a delivered object from its place, m: it is within 3 cm."""

GRIPPED_WITHIN = 0.003
"""Greatest difference of the fingers' gap from the width of the object that they hold, m."""

SAME_SIZE = 0.08
"""Difference of an object's height from that of its kind, as a share of it, that the picture makes."""

SIZES, SIZES_IF_WIDE = (0.75, 1.3), (0.5, 1.6)
"""Least and greatest height of an object over that of its kind, and the same where its top is as much smaller
or larger: else what is seen around it is not what it stands on."""

SIMILAR = 0.15
"""Greatest difference of these two."""

TOP_POINTS = 25
"""Number of points nearest to an object's middle, seen from above, that its top is measured by."""

SUPPORT_AROUND = (0.03, 0.11)
"""Distances from an object's middle of what it stands on, m."""

SUPPORT_DEPTH = 0.5
"""Least depth of what an object stands on below its top, over the object's height."""

SUPPORT_SHARE, SUPPORT_BIN = 0.2, 0.01
"""Least share of the points around an object that are at the height of what it stands on, and the tolerance
of that height, m."""

STAND_HALF = (0.12, 0.22)
"""Half of a stand's length and width that is looked at for its height, m."""

STAND_WITHIN = 0.04
"""Greatest difference of a stand's height from the surveyed one, m."""

UNNOTICED = 0.012
"""Greatest error of a height in a picture that a tilted camera makes, m: a stand that is seen higher or lower
by more is."""

SURVEYED_FOR = 0.04
"""Height of the middle of the object for which the place to deliver was surveyed, over its stand, m."""

SIDES = {"middle": 0.0, "left": 0.12, "right": -0.12}
"""Where on the stand the object belongs, along y from the surveyed place, m; anywhere is each of them."""

ON_STAND, BESIDE_SPOT = 0.02, 0.01
"""Least height over the stand of what is in the way there, and distance that it keeps from the object, m."""

DELIVERY = ("delivery_offset", "delivery_yaw", "delivery_free_across", "delivery_taken")
"""Variables of where there is room to put the object down."""

REMEMBERED = ("stand_lift", "object_lying", "object_scale")
"""Values that a picture need not show again for the room that the object needs on the other stand."""

MAX_AGE = 30.0
"""Greatest age of a picture that still says where the object is, s."""

REACH = (0.50, 0.70)
"""Horizontal distance from the arm's base at which it can pick objects, m; nearer ones on the floor are
at the carriage."""

FAR_OFF = 0.1
"""Distance beyond `REACH` from which a look from nearer by would not show the object in reach, m."""

OFF_BENCHES, LOW = 0.63, 0.15
"""Least y of an object on the floor that the hand can grip, m, and least depth of such an object below the
arm's base: nearer to the site's `bench` the arm's sixth link is too near to that, with a hand that is turned
and grips beside the middle."""

REACH_ASIDE = 0.15
"""Greatest lateral offset of an object from the arm's base, m: beyond it the elbow would hit the stand."""

FLOOR = ((WESTMOST, 0.03), (-1.295, 2.595))
"""Bounds of the arm's base in x and in y, m: 5 mm inside the site's `floor`, whose bound no double is."""

SURVEYED = ("station_survey", "delivery_position")
"""Places of the stands."""

AROUND_STANDS = ((-0.80, -0.55), (0.55, 0.55))
"""Margins of the area around these places, along x and y, in which the can is looked for, m: in the west as
far as the aisle."""

NEARER = 0.15
"""How much nearer to the arm's base than `REACH` an object on a stand may be, m."""

SAME_PLACE = 0.15
"""Standard uncertainty of a place from memory, m: positions as near as that count as one usual place."""

ARRIVED_WITHIN = 0.03
"""Greatest distance of the base from the station at which it has arrived, m."""


class Kind(NamedTuple):
    """The kind of object that is wanted: shape, edges or radius and height (m) as it stands, and colour."""

    shape: str
    size: tuple[float, ...]
    colour: tuple[float, float, float]

    @property
    def height(self) -> float:
        """Height as it stands, m."""
        return self.size[-1]

    @property
    def sides(self) -> tuple[float, float]:
        """Length and width, as it stands, m."""
        if self.shape == "cylinder":
            return 2.0 * self.size[0], 2.0 * self.size[0]
        return max(self.size[:2]), min(self.size[:2])

    @property
    def diagonal(self) -> float:
        """Greatest distance of two of its points, m."""
        return hypot(*self.sides, self.height)

    @property
    def lying_height(self) -> float:
        """Height of a cylinder on its side, m."""
        return 2.0 * self.size[0]

    @property
    def widths(self) -> tuple[float, ...]:
        """Gaps between fingers that hold it, m."""
        return (2.0 * self.size[0],) if self.shape == "cylinder" else tuple(sorted(self.size)[:2])


class GripStation(NamedTuple):
    """Place at which an object was seen, and distance to its left at which the base stands to grip it, m."""

    place: Place
    aside: float


class Seen(NamedTuple):
    """The object in a picture: place, height of its top, if it lies, its heading and those for a hand."""

    position: Place
    top: float
    is_lying: bool
    axis: float | None
    headings: tuple[float, ...]


def find_object(view: View) -> Perception:
    """Find the object in the newest picture; what a picture does not show keeps the value and time it had.

    Elsewhere in the cell things of its colour are of other tasks. Where the stands are has to be known.
    """
    known: dict[str, Any] = {}
    newest = -1.0
    search = Search({}, {}, {})
    station: GripStation | None = None
    is_seen, seen_above = False, None
    is_missed = False
    while True:
        kind = _kind(view.readings)
        if kind is not None and all(place in view.readings for place in SURVEYED):
            stands = np.array([view.readings[place][:2] for place in SURVEYED])
            for name in ("mast", "hand", "aisle_top"):
                picture = view.pictures.get(name)
                if picture is None or picture.time <= newest:
                    continue
                if name == "aisle_top":
                    if is_seen and seen_above is None:
                        continue
                    found = _look_from_above(picture, kind, stands, view.readings)
                    if not found:
                        if _has_colour(picture, kind, stands, view.readings, search):
                            continue
                        if seen_above is not None and _shows(picture, seen_above[0], kind):
                            is_seen, seen_above = False, None
                            known["object_seen"] = estimate(False, time=picture.time)
                        if not is_seen:
                            shown = _floor_points(picture, kind, view.readings)
                            known |= search.look_at(picture.time, *shown, stands, _last(known))
                        continue
                    seen_above = found["object_position"]
                else:
                    given = {**view.readings, **_remembered(known)}
                    mask, larger = _find_kind(picture, kind, stands, view.readings)
                    found = _look(picture, kind, name == "mast", mask, given)
                    if found["object_seen"] == (True,):
                        seen_above = None
                    elif name == "mast" and seen_above and not _shows(picture, seen_above[0], kind):
                        continue
                is_seen = found["object_seen"] == (True,)
                if is_seen or (name == "mast" and not is_missed):
                    # What was looked over before it was missed says nothing of where it may be since.
                    search = Search({}, {}, {})
                is_missed = not is_seen and (is_missed or name == "mast")
                if is_seen:
                    station = _farther_aside(station, found)
                    if station is not None:
                        found["object_aside"] = (station.aside, UNCERTAINTY)
                for variable, value in found.items():
                    known[variable] = None if value is None else estimate(*value, time=picture.time)
                is_look = name == "mast" and not is_seen
                shown, unlike = NOTHING, None
                if is_look:
                    points = picture.points()
                    shown = (points, is_lit_for(picture.rgb, kind.colour))
                    unlike = points[larger]
                partly = found.get("object_dark_place")
                last = _last(known) if partly is None else partly[0]
                is_partly = partly is not None
                known |= search.look_at(
                    picture.time, *shown, stands, last, is_partly_dark=is_partly, unlike=unlike
                )
            newest = max(picture.time for picture in view.pictures.values())
        view = yield known.copy()


def _last(known: Mapping[str, Any]) -> Place | None:
    """Return where the object was seen last; None if it was not."""
    seen = known.get("object_position")
    return None if seen is None else seen.value


def _remembered(known: Mapping[str, Any]) -> dict[str, Any]:
    """Return what earlier pictures showed of the object and of the other stand."""
    return {name: known[name].value for name in REMEMBERED if known.get(name) is not None}


def _farther_aside(
    before: GripStation | None, found: Mapping[str, tuple[Any, ...] | None]
) -> GripStation | None:
    """Return the station by the newest picture; of an object that lies still, the one farthest aside so far.

    From another place a picture shows less or more of what is beside it.
    """
    position, aside = found["object_position"], found.get("object_aside")
    if position is None or aside is None:
        return before
    here = GripStation(position[0], aside[0])
    if before is None or dist(before.place, here.place) > STILL_WITHIN:
        return here
    return before if abs(before.aside) >= abs(here.aside) else here


def track(view: View) -> Perception:
    """Say if the object is held, where it belongs, and where to drive for it.

    What was seen before it was held no longer holds.
    """
    moved_at = -1.0
    slips = NO_SLIP
    while True:
        given = view.readings
        held = _is_held(given)
        slips = slips_with(slips, given, held)
        if held:
            moved_at = view.time
        seen_at = given.get("object_seen_time", -1.0) if given.get("object_seen") else -1.0
        is_fresh = seen_at > moved_at and view.time - seen_at <= MAX_AGE
        values: dict[str, Any] = {
            "object_grasped": held,
            "object_detected": None if held is None else held or is_fresh,
            "object_slips": None if held is None else slips.times,
            "object_slips_out": None if held is None else slips.times >= SLIPS_OUT,
        }
        kind, place = _kind(given), _place(given)
        is_lying = given.get("object_lying") is True
        height = 0.0
        if kind is not None:
            # A larger one that is put down as low as its kind would be pressed on the stand.
            height = (kind.lying_height if is_lying else kind.height) * given.get("object_scale", 1.0)
            values["object_fits"] = fits_hand(*kind.sides, kind.height)
            values["object_grip_height"] = estimate(grip_height(height, is_lying=is_lying), UNCERTAINTY)
        if kind is not None and place is not None:
            x, y, z = place
            y += given.get("delivery_offset", _offsets(given)[0])
            z += given.get("stand_lift", 0.0)
            values["object_place"] = estimate((x, y, z + height / 2.0), UNCERTAINTY)
        if "station_survey" in given and "base_position" in given:
            seen = given.get("object_position") if is_fresh else None
            station = _station_for(given["station_survey"], seen, given.get("object_aside", 0.0))
            away = 0.0 if seen is None else dist(seen[:2], station[:2])
            if away > REACH[1] + FAR_OFF or (seen is None and _is_searched(given)):
                # From nowhere the arm reaches it, or all was looked over: no place is better than this one.
                x, y, _ = given["base_position"]
                station = (x, y, station[2])
            values["station_position"] = estimate(station, UNCERTAINTY)
            values["robot_at_target"] = dist(given["base_position"][:2], station[:2]) < ARRIVED_WITHIN
            values["object_out_of_reach"] = False
            if seen is not None:
                is_low = seen[2] < given["base_position"][2] - LOW
                is_far = not REACH[0] - NEARER <= away <= REACH[1] + UNCERTAINTY
                values["object_distance"] = estimate(away, UNCERTAINTY)
                values["object_out_of_reach"] = is_far or (is_low and seen[1] < OFF_BENCHES)
        view = yield values


def _is_searched(given: Mapping[str, Any]) -> bool:
    return any(given.get(name) is True for name in ("object_absent", "search_darkened", "object_unlike"))


def remember(view: View) -> Perception:
    """Say where memory expects the object that is wanted: nothing of this is measured."""
    while True:
        known = view.readings["memory"].get(f"object.{view.readings.get('object')}")
        values: dict[str, Any] = {}
        if known is not None:
            is_usual = not known["in_session"] and 2.0 * known["usual_sessions"] > known["sessions"]
            place = known["usual"] if is_usual else known["position"]
            values["object_expected_place"] = estimate(place, SAME_PLACE)
        view = yield values


def _kind(given: Mapping[str, Any]) -> Kind | None:
    """Return the kind of object that is wanted; None if its looks are unknown."""
    kind = given.get("objects", {}).get(given.get("object"))
    if kind is None or not kind["size"] or kind["colour"] is None:
        return None
    return Kind(kind["shape"], tuple(kind["size"]), tuple(kind["colour"]))


def _place(given: Mapping[str, Any]) -> Place | None:
    """Return the middle of the stand to which the object belongs, on its top."""
    if "delivery_position" not in given or "to" not in given:
        return None
    x, y, z = given["delivery_position"]
    return (x, y, z - SURVEYED_FOR)


def _offsets(given: Mapping[str, Any]) -> tuple[float, ...]:
    """Return where the object may stand, along y from the middle of the stand, in the order of trial."""
    side = SIDES.get(given["to"])
    return tuple(SIDES.values()) if side is None else (side,)


def _is_held(given: Mapping[str, Any]) -> bool | None:
    kind = _kind(given)
    if kind is None or "holding" not in given or "finger_gap" not in given:
        return None
    # One of a kind may be smaller or larger: as its height was seen to be.
    scale = given.get("object_scale", 1.0)
    fits = any(abs(given["finger_gap"] - scale * width) < GRIPPED_WITHIN for width in kind.widths)
    return bool(given["holding"]) and fits


def _station_for(surveyed: Place, seen: Place | None, aside: float) -> Place:
    """Return where the arm's base should be to pick the can.

    It is the surveyed station, unless the can was seen out of reach from there, or the forearm would hit what
    is beside it; then the place on the floor from which it is in reach, and so far aside.
    """
    if seen is None:
        return surveyed
    away, off = dist(seen[:2], surveyed[:2]), abs(seen[1] - surveyed[1])
    is_ahead = seen[0] > surveyed[0] and REACH[0] <= away <= REACH[1] and off <= REACH_ASIDE
    if aside == 0.0 and is_ahead:
        return surveyed
    (west, east), (south, north) = FLOOR
    # Beside an object in the aisle the base stands on the side away from the benches, if there is floor.
    u, v = base_from(seen[0], aside)
    if seen[1] + v > north:
        u, v = base_from(seen[0], -v)
    x, y = seen[0] + u, seen[1] + v
    return (min(east, max(west, x)), min(north, max(south, y)), surveyed[2])


def _aside(points: Points, place: Place) -> float:
    """Return how far to the left the base stands so that the forearm passes what is beside an object.

    Of a picture's points (h, w, 3). It is 0 if that is so from right before it, and if it is so from nowhere.
    """
    high = points[points[:, :, 2] > place[2] + FOREARM_ABOVE]
    for aside in ASIDES:
        u, v = base_from(place[0], aside)
        along, across = np.array((-u, -v)) / STATION_TO_OBJECT, np.array((v, -u)) / STATION_TO_OBJECT
        off = high[:, :2] - np.array(place[:2])
        away, left = off @ along, off @ across
        is_hit = (away > FOREARM_AWAY[0]) & (away < FOREARM_AWAY[1])
        is_hit &= (left > FOREARM_ASIDE[0]) & (left < FOREARM_ASIDE[1])
        if int(is_hit.sum()) < MIN_HIT:
            return aside
    return 0.0


def _look(
    picture: Picture, kind: Kind, is_mast: bool, mask: Mask, given: Mapping[str, Any]
) -> dict[str, tuple[Any, ...] | None]:
    """Return value and uncertainty of what a picture shows; None for a value that is no longer known.

    Only the mast's camera sees if there is room for a hand around it, and if it is where it belongs.
    """
    points, belongs = picture.points(), _place(given)
    values: dict[str, tuple[Any, ...] | None] = {}
    if belongs is not None and is_mast:
        x, y, surveyed = belongs
        height = _stand_height(points[~mask], belongs)
        if height is None:
            height = surveyed + given.get("stand_lift", 0.0)
        else:
            values["stand_lift"] = (believe_height(height, surveyed, UNNOTICED) - surveyed, UNCERTAINTY)
        others = points[~mask & _is_off_robot(points, given)]
        values |= _room_to_put(others, kind, (x, y, height), given)
        is_lit = is_lit_for(picture.rgb, kind.colour)
        lit = points[~mask & is_lit & _is_off_robot(points, given)]
        is_empty = _shows_all_spots(lit, kind, (x, y, height), given)
        values["object_delivered"] = (False,) if is_empty else None
    if int(mask.sum()) < MIN_PIXELS:
        return values | {"object_seen": (False,)}
    if _is_partly_dark(picture, points, mask, kind):
        place = tuple(np.median(points[mask], axis=0).tolist())
        return values | {"object_seen": (False,), "object_delivered": None, "object_dark_place": (place,)}
    found, support = _locate(points[mask], points[~mask], kind)
    if support is not None and is_mast:
        height = kind.lying_height if found.is_lying else kind.height
        scale = (_level(points[mask], found.position) - support) / height
        values["object_scale"] = (1.0 if abs(scale - 1.0) < SAME_SIZE else scale, 0.05)
    values |= {
        "object_seen": (True,),
        "object_seen_time": (picture.time, 1e-3),
        "object_position": (found.position, UNCERTAINTY),
        "object_lying": (found.is_lying,),
    }
    if found.is_lying or kind.shape == "box":
        values["object_yaw"] = (found.headings[0], HEADING_UNCERTAINTY)
    if not is_mast:
        return values
    # Visible points that a hand would hit.
    higher = points[points[:, :, 2] > found.top + HAND_CLEARANCE]
    beside = points[~mask & (points[:, :, 2] > found.position[2])]
    grip = _grip_with_room(higher, beside, found)
    push = None
    if found.axis is not None and grip is None:
        push = _shortest_push(higher, found.position, found.axis, kind.height / 2.0)
    values["object_free"] = (grip is not None,)
    values["object_free_across"] = (grip is not None and _has_room_across(higher, found, *grip),)
    values["object_grip_offset"] = ((0.0, 0.0, 0.0) if grip is None else grip[1], UNCERTAINTY)
    values["object_aside"] = (_aside(points, found.position), UNCERTAINTY)
    values["object_yaw"] = (found.headings[0] if grip is None else grip[0], HEADING_UNCERTAINTY)
    values["object_push_start"] = None if push is None else (push[0], UNCERTAINTY)
    values["object_push_way"] = None if push is None else (push[1], UNCERTAINTY)
    if belongs is not None:
        dx, dy, _ = (a - b for a, b in zip(found.position, belongs, strict=True))
        nearest = min(max(dy, min(_offsets(given))), max(_offsets(given)))
        if hypot(dx, dy - nearest) >= DELIVERED_WITHIN:
            values["object_delivered"] = (False,)
        else:
            # It may be held over its place, as long as nothing around it shows what it stands on.
            stands_there = None if support is None else (abs(support - belongs[2]) < STAND_WITHIN,)
            values["object_delivered"] = stands_there
    return values


def _room_to_put(
    points: Points, kind: Kind, middle: Place, given: Mapping[str, Any]
) -> dict[str, tuple[Any, ...] | None]:
    """Return the first spot on the stand with room for the object and a hand.

    All is unknown if the picture does not show a spot before it: the hand may hide it.

    Args:
        points: of the picture, without the object and the robot (n, 3).
        kind: of the object.
        middle: of the stand's top, as high as the picture shows it.
        given: readings, and what earlier pictures showed.

    Returns:
        Value and uncertainty of each variable, by name; None where it is unknown.
    """
    x, y, z = middle
    is_lying = given.get("object_lying") is True
    scale = given.get("object_scale", 1.0)
    top = z + scale * (kind.lying_height if is_lying else kind.height)
    half = scale * (kind.height if is_lying else hypot(*kind.sides)) / 2.0
    on_stand = points[points[:, 2] > z - STAND_WITHIN]
    beside = on_stand[on_stand[:, 2] > z + ON_STAND]
    higher = on_stand[on_stand[:, 2] > top + HAND_CLEARANCE]
    unknown: dict[str, tuple[Any, ...] | None] = dict.fromkeys(DELIVERY)
    for offset in _offsets(given):
        spot = (x, y + offset, z)
        above = np.hypot(beside[:, 0] - spot[0], beside[:, 1] - spot[1]) < half + BESIDE_SPOT
        if int(above.sum()) >= MIN_HIT:
            continue
        if not _shows_spot(on_stand[on_stand[:, 2] < z + ON_STAND], spot, half):
            return unknown
        yaws = [
            yaw
            for yaw in GRIP_HEADINGS
            if _has_room(higher, spot, yaw) and not _is_below_fingers(beside, spot, yaw)
        ]
        if yaws:
            return {
                "delivery_offset": (offset, UNCERTAINTY),
                "delivery_yaw": (yaws[0], HEADING_UNCERTAINTY),
                "delivery_free_across": (len(yaws) > 1,),
                "delivery_taken": (False,),
            }
    return {**unknown, "delivery_taken": (True,)}


def _shows_all_spots(points: Points, kind: Kind, middle: Place, given: Mapping[str, Any]) -> bool:
    """Return True if points (n, 3) in light, none of them the object's, show each spot where it may stand.

    Args:
        points: of the picture, without the object and the robot, m.
        kind: of the object.
        middle: of the stand's top, as high as the picture shows it.
        given: readings.
    """
    x, y, z = middle
    top = points[np.abs(points[:, 2] - z) < ON_STAND]
    return all(_shows_spot(top, (x, y + offset, z), kind.sides[0]) for offset in _offsets(given))


def _shows_spot(points: Points, spot: Place, half: float) -> bool:
    """Return True if some of `points` (n, 3) of a face are in each quarter of the circle around a spot."""
    off = points[:, :2] - np.array(spot[:2])
    off = off[np.hypot(off[:, 0], off[:, 1]) < half]
    quarters = 2 * (off[:, 0] > 0.0) + (off[:, 1] > 0.0)
    return bool((np.bincount(quarters, minlength=4) >= MIN_HIT).all())


def _look_from_above(
    picture: Picture, kind: Kind, stands: Points, given: Mapping[str, Any]
) -> dict[str, tuple[Any, ...] | None]:
    """Return what the camera over the aisle shows of an object on the floor; empty if it shows none.

    One pixel is a third of a can, so the hand's camera has to look again.
    """
    if "base_position" not in given:
        return {}
    points = picture.points()
    floor = given["base_position"][2] - FLOOR_BELOW
    above = points[:, :, 2] - floor
    mask = has_colour_of(picture.rgb, kind.colour) & _is_around(points, stands)
    mask &= _is_off_robot(points, given)
    mask &= (above > ON_FLOOR[0]) & (above < kind.height + ON_FLOOR[1])
    parts = sorted(separate_parts(mask, MIN_FROM_ABOVE), key=np.count_nonzero, reverse=True)
    if not parts or float(np.linalg.norm(np.ptp(points[parts[0]], axis=0))) > LARGEST_SCALE * kind.diagonal:
        return {}
    own = points[parts[0]]
    x, y, top = np.median(own, axis=0).tolist()
    is_lying = kind.shape == "cylinder" and 2.0 * (top - floor) < kind.height + kind.lying_height
    height = kind.lying_height if is_lying else kind.height
    place: Place = (x, y, floor + height / 2.0)
    headings: tuple[float, ...] = GRIP_HEADINGS
    if is_lying:
        u, v = np.linalg.eigh(np.cov(own[:, :2].T))[1][:, -1].tolist()
        headings = (wrap_heading(atan2(v, u), pi),)
    higher = points[(points[:, :, 2] > floor + height + HAND_CLEARANCE) & _is_off_robot(points, given)]
    free = [heading for heading in headings if _has_room(higher, place, heading)]
    return {
        "object_seen": (True,),
        "object_seen_time": (picture.time, 1e-3),
        "object_position": (place, 2.0 * UNCERTAINTY),
        "object_lying": (is_lying,),
        "object_yaw": ((free or headings)[0], 2.0 * HEADING_UNCERTAINTY),
        "object_free": (bool(free),),
        "object_free_across": (len(free) > 1,),
        "object_grip_offset": ((0.0, 0.0, 0.0), UNCERTAINTY),
        "object_aside": (0.0, UNCERTAINTY),
        "object_scale": (1.0, 0.05),
        "object_push_start": None,
        "object_push_way": None,
    }


def _has_colour(
    picture: Picture, kind: Kind, stands: Points, given: Mapping[str, Any], search: Search
) -> bool:
    """Check that a picture may show the object, anywhere near the stands; True while the base is unknown.

    At the carriage, too, which hides no colour but grey; not where the mast showed what is larger.
    """
    if "base_position" not in given:
        return True
    points = picture.points()
    mask = has_colour_of(picture.rgb, kind.colour) & _is_around(points, stands)
    if _is_grey(kind):
        mask &= _is_off_robot(points, given)
    return search.count_elsewhere(points[mask], stands) >= MIN_FROM_ABOVE


def _is_grey(kind: Kind) -> bool:
    return max(kind.colour) - min(kind.colour) < GREYISH * max(kind.colour)


def _shows(picture: Picture, place: Place, kind: Kind) -> bool:
    """Check that a picture shows in light what is at a place, or below it where it is gone."""
    points = picture.points()[is_lit_for(picture.rgb, kind.colour)]
    near = np.hypot(points[:, 0] - place[0], points[:, 1] - place[1]) < SHOWN_WITHIN
    return bool((near & (points[:, 2] < place[2] + SHOWN_WITHIN)).any())


def _floor_points(picture: Picture, kind: Kind, given: Mapping[str, Any]) -> tuple[Points, Mask]:
    """Return the points (n, 3) of floor that a picture shows, and a mask of those in light.

    Of a grey object only those off the grey robot.
    """
    x, y, z = given["base_position"]
    points, is_lit = picture.points(), is_lit_for(picture.rgb, kind.colour)
    low = points[:, :, 2] < z - FLOOR_BELOW + ON_FLOOR[1]
    if _is_grey(kind):
        u, v = given.get("tool_position", (x, y, z))[:2]
        low &= np.hypot(points[:, :, 0] - x, points[:, :, 1] - y) > CARRIAGE_RADIUS
        low &= np.hypot(points[:, :, 0] - u, points[:, :, 1] - v) > HAND_RADIUS
    return points[low], is_lit[low]


def _find_kind(picture: Picture, kind: Kind, stands: Points, given: Mapping[str, Any]) -> tuple[Mask, Mask]:
    """Return the largest part of the object's colour that is not larger than it, and all that are larger.

    Robot, carriage and floor are grey, so what is on them counts for no grey object.
    """
    points = picture.points()
    mask = has_colour_of(picture.rgb, kind.colour) & _is_around(points, stands)
    if _is_grey(kind):
        mask &= _is_off_robot(points, given)
    part, larger = parts_of(mask, points, kind.diagonal)
    return np.zeros_like(mask) if part is None else part, larger


def _is_partly_dark(picture: Picture, points: Points, mask: Mask, kind: Kind) -> bool:
    """Check that a part of the object's colour is smaller than the object and ends at what is dark."""
    low, high = np.percentile(points[mask], (2.0, 98.0), axis=0)
    if float(np.linalg.norm(high - low)) >= WHOLE * kind.diagonal:
        return False
    # Erosion takes the border of the picture away, which is no rim of a part.
    rim = (~erode(~mask) & ~mask)[1:-1, 1:-1]
    dark = rim & ~is_lit_for(picture.rgb, kind.colour)[1:-1, 1:-1]
    return int(dark.sum()) >= DARK_RIM * int(rim.sum())


def _is_off_robot(points: Points, given: Mapping[str, Any]) -> Mask:
    """Return the points that are neither of the robot nor of the floor."""
    x, y, z = given.get("base_position", (0.0, 0.0, 0.0))
    u, v, w = given.get("tool_position", (x, y, z))
    is_off: Mask = np.hypot(points[:, :, 0] - x, points[:, :, 1] - y) > CARRIAGE_RADIUS
    is_off &= points[:, :, 2] > z - FLOOR_DEPTH
    # What the hand's own camera sees is below the hand.
    is_hand = np.hypot(points[:, :, 0] - u, points[:, :, 1] - v) < HAND_RADIUS
    is_off &= ~(is_hand & (points[:, :, 2] > w - HAND_ABOVE))
    return is_off


def _locate(points: Points, around: Points, kind: Kind) -> tuple[Seen, float | None]:
    """Locate the object, and the height of what it stands on: its own height need not be that of its kind.

    The latter is None if nothing is seen below it, or not as far below its top as it is high.
    """
    if kind.shape == "cylinder":
        radius, height = kind.size
        can = locate_cylinder(points, radius, height)
        headings = GRIP_HEADINGS if can.axis is None else (can.axis,)
        seen = Seen(can.position, can.top, can.axis is not None, can.heading, headings)
    else:
        box = locate_box(points, kind.size)
        seen = Seen(box.position, box.top, False, None, box.headings)
    x, y, z = seen.position
    half = float(np.median(upper_points(points)[:, 2])) - z
    level = _level(points, seen.position)
    support = _support(around, seen.position, level - SUPPORT_DEPTH * 2.0 * half)
    if support is None:
        return seen, None
    scale = (level - support) / (2.0 * half)
    if not SIZES[0] < scale < SIZES[1]:
        top = min_area_rectangle(upper_points(points)[:, :2])
        length = kind.height if seen.is_lying else kind.sides[0]
        is_similar = abs(max(top.length, top.width) / length - scale) < SIMILAR
        if not (is_similar and SIZES_IF_WIDE[0] < scale < SIZES_IF_WIDE[1]):
            return seen, None
    middle = (x, y, (level + support) / 2.0)
    return Seen(middle, seen.top, seen.is_lying, seen.axis, seen.headings), support


def _level(points: Points, place: Place) -> float:
    """Return the height of an object's top: of its highest points, noise makes too much."""
    away = np.hypot(points[:, 0] - place[0], points[:, 1] - place[1])
    return float(np.median(points[np.argsort(away)[:TOP_POINTS]][:, 2]))


def _support(points: Points, place: Place, below: float) -> float | None:
    """Return the height of what an object at a place stands on: the highest level around it."""
    away = np.hypot(points[:, 0] - place[0], points[:, 1] - place[1])
    near = (away > SUPPORT_AROUND[0]) & (away < SUPPORT_AROUND[1]) & (points[:, 2] < below)
    heights = np.sort(points[near][:, 2])
    if len(heights) < MIN_PIXELS:
        return None
    # Number of points at most `SUPPORT_BIN` below each one.
    level = np.arange(1, len(heights) + 1) - np.searchsorted(heights, heights - SUPPORT_BIN)
    highest = np.nonzero(level >= SUPPORT_SHARE * len(heights))[0]
    if len(highest) == 0:
        return None
    last = heights[highest[-1]]
    return float(np.median(heights[(heights <= last) & (heights >= last - SUPPORT_BIN)]))


def _stand_height(points: Points, belongs: Place) -> float | None:
    """Return the height of the stand to which the object belongs, as points show it; None if none do."""
    x, y, z = belongs
    on_stand = (np.abs(points[:, 0] - x) < STAND_HALF[0]) & (np.abs(points[:, 1] - y) < STAND_HALF[1])
    heights = points[on_stand & (np.abs(points[:, 2] - z) < STAND_WITHIN)][:, 2]
    if len(heights) < 4 * MIN_PIXELS:
        return None
    return float(np.median(heights))


def _is_around(points: Points, places: Points) -> Mask:
    """Find the points (h, w, 3) of a picture that are near the rectangle that places (n, 2) span."""
    low, high = places.min(axis=0) + AROUND_STANDS[0], places.max(axis=0) + AROUND_STANDS[1]
    around: Mask = ((points[:, :, :2] > low) & (points[:, :, :2] < high)).all(axis=2)
    return around


def _has_room(points: Points, place: Place, yaw: float, half: tuple[float, float] = HAND_HALF) -> bool:
    """Return True if none of `points` (n, 3) is where a hand at `yaw` over `place` would be."""
    along, across = np.array((cos(yaw), sin(yaw))), np.array((-sin(yaw), cos(yaw)))
    away = points[:, :2] - np.array(place[:2])
    inside = (np.abs(away @ along) < half[0]) & (np.abs(away @ across) < half[1])
    return not bool(inside.any())


def _grip_with_room(points: Points, beside: Points, found: Seen) -> tuple[float, Place] | None:
    """Return heading and offset from its middle of a hand that has room to grip an object; None if none has.

    One that lies may be gripped beside its middle, along its axis. Where nothing of what stands beside it is
    below the fingers is tried first: what is low and loose may give way.
    """
    x, y, z = found.position
    with_room: list[tuple[float, Place]] = []
    for along in GRIPS_ALONG if found.axis is not None else (0.0,):
        u, v = (0.0, 0.0) if found.axis is None else (along * cos(found.axis), along * sin(found.axis))
        for heading in found.headings:
            place = (x + u, y + v, z)
            if _has_room(points, place, heading):
                if not _is_below_fingers(beside, place, heading):
                    return heading, (u, v, 0.0)
                with_room.append((heading, (u, v, 0.0)))
    return with_room[0] if with_room else None


def _is_below_fingers(points: Points, place: Place, yaw: float) -> bool:
    """Return True if some of `points` (n, 3) are where the fingers of an open hand at `yaw` come down."""
    away = points[:, :2] - np.array(place[:2])
    along = np.abs(away @ np.array((cos(yaw), sin(yaw))))
    across = np.abs(away @ np.array((-sin(yaw), cos(yaw))))
    half, (inner, outer) = FINGER_HALF, FINGERS_ACROSS
    return int(((along < half) & (across > inner) & (across < outer)).sum()) >= MIN_HIT


def _has_room_across(points: Points, found: Seen, heading: float, offset: Place) -> bool:
    """Return True if an object that stands has room for a hand turned by a right angle, too."""
    x, y, z = (a + b for a, b in zip(found.position, offset, strict=True))
    return found.axis is None and _has_room(points, (x, y, z), heading + pi / 2.0)


def _shortest_push(points: Points, place: Place, axis: float, half: float) -> tuple[Place, Place] | None:
    """Return start and way of the shortest push along `axis` to where a hand has room.

    The end that is pushed is `half` of the can's length from its middle, along the axis. The pushing hand has
    room, too, all along its way. The fingers push as near to the axis as possible.
    """
    x, y, z = place
    for asides, askew in ((one, other) for one in PUSH_ASIDE for other in PUSH_ASKEW):
        for away in np.arange(SEARCH_STEP, SEARCH_RADIUS, SEARCH_STEP).tolist():
            for ahead in (axis, axis + pi):
                way = ahead + askew
                u, v = cos(way), sin(way)
                end = (x - half * cos(ahead), y - half * sin(ahead))
                if not _has_room(points, (x + away * u, y + away * v, z), axis):
                    continue
                for aside in asides:
                    start = (end[0] - PUSH_START * u - aside * v, end[1] - PUSH_START * v + aside * u, z)
                    if _can_push(points, start, way, push_length(away)):
                        return start, (away * u, away * v, 0.0)
    return None


def _can_push(points: Points, start: Place, way: float, length: float) -> bool:
    """Return True if a hand that pushes from a place along a heading has room all along."""
    x, y, z = start
    ends = ((x + share * length * cos(way), y + share * length * sin(way), z) for share in PUSH_SHARES)
    return all(_has_room(points, one, way + pi / 2.0, half) for one in ends for half in PUSH_HALVES)
