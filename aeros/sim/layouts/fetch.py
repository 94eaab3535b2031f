"""A room to fetch something in: a red can on a stand, a decoy beside it, a second stand to bring it to.

The robot drives on its carriage, with a camera on a mast and one on the hand.  Where the can is, and so
whether it is delivered, skills learn from pictures alone; whether it is held the fingers feel.
Frame W: origin on the floor under the arm's base at the start.  Not modelled: obstacles on the way.
"""

from __future__ import annotations

from math import cos, dist, hypot, sin
from typing import Any, Final, NamedTuple

from aeros.sim.detected_object import Sight
from aeros.sim.geometry import Camera, Triple, minus, plus
from aeros.sim.randomness import Chance
from aeros.sim.robot.robot import RobotOptions

BASE_HEIGHT: Final = 0.30
"""Height of the arm's base on the carriage over the floor, m."""

ROBOT: Final = RobotOptions(carriage=True, base=(0.0, 0.0, BASE_HEIGHT))

STATION: Final = (1.25, 0.20)
"""Nominal place of the arm's base for picking, m."""

AHEAD: Final = 0.58
"""From the arm's base at the station to the middle of the stand, m."""

STAND: Final = (0.26, 0.50, 0.40)
"""Edges of both stands, m."""

DELIVERY: Final = (1.70, -1.10)
"""Nominal place where the can is to stand, m."""

CAN: Final = (0.022, 0.08)
"""Radius and height of the can, m."""

ROLLING: Final = 0.001
"""Lever of the can's rolling resistance, m."""

DECOY: Final[Triple] = (0.04, 0.04, 0.05)
"""Edges of the decoy, m."""

STATION_SPREAD: Final = 0.08
"""The station, with its stand, is up to this far from its nominal place in x and in y, m."""

CAN_SPREAD: Final = (0.05, 0.12)
"""How far the can is from the middle of its stand in x and in y at most, m."""

DELIVERY_SPREAD: Final = 0.05
"""The place to deliver to is up to this far from its nominal place in x and in y, m."""

ARRIVED: Final = 0.03
"""Distance from the station within which the base is at it, m."""

FRESH: Final = 30.0
"""Age up to which a detection counts, s."""

REACH: Final = (0.50, 0.70)
"""From the arm's base, level: where it takes things up, m; nearer ones on the floor are at the carriage."""

SIDEWAYS: Final = 0.15
"""How far to the side of the arm's base at most: farther, its elbow is where the stand is."""

FLOOR: Final = ((-0.5, 1.6), (-1.4, 0.6))
"""Where the arm's base may be in x and in y, m: the site's `floor`."""

DELIVERED: Final = 0.03
"""Distance from where it belongs within which the can is delivered, m."""

MAST: Final[Triple] = (0.05, 0.20, 0.85)
"""The mast camera's eye from the arm's base, m: over the carriage's left edge."""

MAST_TARGET: Final[Triple] = (0.58, 0.0, 0.12)
"""What the mast camera looks at, from the arm's base, m."""

HAND_EYE: Final = (0.07, 0.06)
"""The hand camera's eye from the tool: along the tool's x axis and up, m.  It looks straight down."""

CAMERAS: Final[tuple[str, ...]] = ("mast", "hand")


class Layout(NamedTuple):
    """Where things are at the start, in W: middles; `stands` of their tops' rectangles at floor level."""

    station: Triple
    can: Triple
    decoy: Triple
    delivery: Triple
    stands: tuple[Triple, Triple]


def lay_room(chance: Chance) -> Layout:
    """Channels of chance: station, can, delivery.  Can and decoy begin 1 mm above their stand."""
    dx, dy = (STATION_SPREAD * float(part) for part in chance.on("station").uniform(-1.0, 1.0, 2))
    station = (STATION[0] + dx, STATION[1] + dy, BASE_HEIGHT)
    x, y = station[0] + AHEAD, station[1]
    draw = [float(part) for part in chance.on("can").uniform(-1.0, 1.0, 2)]
    u, v = x + CAN_SPREAD[0] * draw[0], y + CAN_SPREAD[1] * draw[1]
    aside = y - 0.17 if v > y else y + 0.17
    dx, dy = (DELIVERY_SPREAD * float(part) for part in chance.on("delivery").uniform(-1.0, 1.0, 2))
    delivery = (DELIVERY[0] + dx, DELIVERY[1] + dy, STAND[2] + CAN[1] / 2)
    return Layout(
        station,
        (u, v, STAND[2] + CAN[1] / 2 + 0.001),
        (x, aside, STAND[2] + DECOY[2] / 2 + 0.001),
        delivery,
        ((x, y, STAND[2] / 2), (delivery[0], delivery[1], STAND[2] / 2)),
    )


def camera_at(name: str, base: Triple, tool: Triple, yaw: float) -> Camera:
    """The camera `name` of a robot whose arm's base and tool are there, the tool at `yaw`."""
    if name == "mast":
        return Camera(plus(base, MAST), plus(base, MAST_TARGET))
    if name == "hand":
        ahead, above = HAND_EYE
        eye = plus(tool, (ahead * cos(yaw), ahead * sin(yaw), above))
        below = plus(eye, (0.0, 0.0, -1.0))
        return Camera(eye, below, up=(cos(yaw), sin(yaw), 0.0), field_of_view=70.0)
    raise KeyError(name)


class Seen(NamedTuple):
    """Where the last picture showed the can, and when, s."""

    place: Triple
    time: float


def station_for(station: Triple, seen: Seen | None) -> Triple:
    """Where the arm's base is to be for the can: the station, unless it was seen out of reach from there."""
    if seen is None:
        return station
    away, aside = dist(seen.place[:2], station[:2]), abs(seen.place[1] - station[1])
    if REACH[0] <= away <= REACH[1] and aside <= SIDEWAYS:
        return station
    (west, east), (south, north) = FLOOR
    x, y = seen.place[0] - AHEAD, seen.place[1]
    return (min(east, max(west, x)), min(north, max(south, y)), station[2])


def measured_in_room(
    laid: Layout, base: Triple, held: bool, seen: Seen | None, time: float
) -> dict[str, Any]:
    """Station and place to deliver to, and the task's predicates but for `object_delivered`.

    object_detected holds for `FRESH` seconds after a picture in which the can was found, and while
    it is felt in the hand: an interrupted delivery need not look for what it carries.
    delivery_position is where the can's middle belongs.
    held: whether the can is, as felt.
    seen: in the last picture, None where the can was not in it, or has been held since.
    """
    fresh = seen if seen is not None and time - seen.time <= FRESH else None
    station = station_for(laid.station, fresh)
    return {
        "station_position": station,
        "delivery_position": laid.delivery,
        "robot_at_target": dist(base[:2], station[:2]) < ARRIVED,
        "object_detected": fresh is not None or held,
        "object_grasped": held,
    }


def seen_by(camera: str, found: Sight | None, delivery: Triple) -> dict[str, Any]:
    """What a picture by `camera` says of the can, by vocabulary name.

    The mast alone sees whether there is room for a hand around it, and whether it is where it belongs,
    upright or lying.
    """
    if found is None:
        return {"object_delivered": False} if camera == "mast" else {}
    seen: dict[str, Any] = {"object_position": found.place, "object_lying": found.axis is not None}
    if found.axis is not None:
        seen["object_yaw"] = found.axis
    if camera == "mast":
        # What a picture does not show is not known any more.
        seen["object_push_start"], seen["object_push_way"] = found.push or (None, None)
        dx, dy, dz = minus(found.place, delivery)
        lies = CAN[0] - CAN[1] / 2 if found.axis is not None else 0.0
        seen |= {
            "object_free": found.grip is not None,
            "object_yaw": found.axis or found.grip or 0.0,
            "object_delivered": hypot(dx, dy) < DELIVERED and abs(dz - lies) < 0.01,
        }
    return seen
