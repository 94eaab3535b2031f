"""Layout of a room for fetching: a red can on a stand, a decoy next to it, and a second stand to deliver to.

The robot drives on its carriage, with a camera on a mast and one on the hand. Skills learn from pictures
alone where the can is, and so if it is delivered; the fingers feel if it is held.
Frame W: origin on the floor under the arm's base at the start. Not modelled: obstacles on the way.
"""

from __future__ import annotations

from math import cos, dist, hypot, sin
from typing import Any, Final, NamedTuple

from aeros.sim.detected_object import DetectedObject
from aeros.sim.geometry import Camera, Vector3, add, subtract
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.robot import RobotOptions

BASE_HEIGHT: Final = 0.30
"""Height of the arm's base on the carriage over the floor, m."""

ROBOT: Final = RobotOptions(carriage=True, base=(0.0, 0.0, BASE_HEIGHT))

STATION: Final = (1.25, 0.20)
"""Nominal place of the arm's base for picking, m."""

STATION_TO_STAND: Final = 0.58
"""Distance of the stand's middle from the arm's base at the station, m."""

STAND_SIZE: Final = (0.26, 0.50, 0.40)
"""Edges of both stands, m."""

DELIVERY: Final = (1.70, -1.10)
"""Nominal position to deliver the can to, m."""

CAN_SIZE: Final = (0.022, 0.08)
"""Radius and height of the can, m."""

CAN_ROLLING_RESISTANCE: Final = 0.001
"""Lever of the can's rolling resistance, m."""

DECOY_SIZE: Final[Vector3] = (0.04, 0.04, 0.05)
"""Edges of the decoy, m."""

STATION_SPREAD: Final = 0.08
"""Greatest random offset of the station with its stand, in x and in y, m."""

CAN_SPREAD: Final = (0.05, 0.12)
"""Greatest random offset of the can from the middle of its stand, in x and in y, m."""

DELIVERY_SPREAD: Final = 0.05
"""Greatest random offset of the delivery position, in x and in y, m."""

STATION_TOLERANCE: Final = 0.03
"""Greatest distance of the base from the station at which it has arrived, m."""

MAX_DETECTION_AGE: Final = 30.0
"""Greatest age of a detection that still counts, s."""

GRASP_REACH: Final = (0.50, 0.70)
"""Horizontal distance from the arm's base at which it can pick objects, m; nearer ones on the floor are at
the carriage."""

MAX_LATERAL_OFFSET: Final = 0.15
"""Greatest lateral offset of an object from the arm's base, m: beyond it the elbow would hit the stand."""

FLOOR_BOUNDS: Final = ((-0.5, 1.6), (-1.4, 0.6))
"""Bounds of the arm's base in x and in y, m: the site's `floor`."""

DELIVERY_TOLERANCE: Final = 0.03
"""Greatest distance of a delivered can from its target, m."""

MAST_CAMERA_OFFSET: Final[Vector3] = (0.05, 0.20, 0.85)
"""Position of the mast camera relative to the arm's base, m: over the carriage's left edge."""

MAST_TARGET: Final[Vector3] = (0.58, 0.0, 0.12)
"""Point that the mast camera looks at, relative to the arm's base, m."""

HAND_CAMERA_OFFSET: Final = (0.07, 0.06)
"""Position of the hand camera relative to the tool: along the tool's x axis and up, m. It looks straight
down."""

CAMERAS: Final[tuple[str, ...]] = ("mast", "hand")


class RoomLayout(NamedTuple):
    """Initial positions in W, m.

    Attributes:
        station: of the arm's base for picking.
        can: its middle.
        decoy: its middle.
        delivery: goal position of the can's middle, in W, m.
        stands: middles of the stand to pick from and of the stand to deliver to.
    """

    station: Vector3
    can: Vector3
    decoy: Vector3
    delivery: Vector3
    stands: tuple[Vector3, Vector3]


def sample_room_layout(chance: RandomSource) -> RoomLayout:
    """Draw the initial layout of the room; can and decoy begin 1 mm above their stand.

    Args:
        chance: random source; channels `station`, `can` and `delivery`.

    Returns:
        The layout, in W.
    """
    dx, dy = (STATION_SPREAD * float(part) for part in chance.generator("station").uniform(-1.0, 1.0, 2))
    station = (STATION[0] + dx, STATION[1] + dy, BASE_HEIGHT)
    x, y = station[0] + STATION_TO_STAND, station[1]
    draw = [float(part) for part in chance.generator("can").uniform(-1.0, 1.0, 2)]
    u, v = x + CAN_SPREAD[0] * draw[0], y + CAN_SPREAD[1] * draw[1]
    aside = y - 0.17 if v > y else y + 0.17
    dx, dy = (DELIVERY_SPREAD * float(part) for part in chance.generator("delivery").uniform(-1.0, 1.0, 2))
    delivery = (DELIVERY[0] + dx, DELIVERY[1] + dy, STAND_SIZE[2] + CAN_SIZE[1] / 2)
    return RoomLayout(
        station,
        (u, v, STAND_SIZE[2] + CAN_SIZE[1] / 2 + 0.001),
        (x, aside, STAND_SIZE[2] + DECOY_SIZE[2] / 2 + 0.001),
        delivery,
        ((x, y, STAND_SIZE[2] / 2), (delivery[0], delivery[1], STAND_SIZE[2] / 2)),
    )


def camera_at(name: str, base: Vector3, tool: Vector3, yaw: float) -> Camera:
    """Return a camera of a robot in a given pose.

    Args:
        name: `mast` or `hand`.
        base: position of the arm's base in W, m.
        tool: position of the tool in W, m.
        yaw: heading of the tool in W, rad.

    Returns:
        The camera, in W.

    Raises:
        KeyError: there is no such camera.
    """
    if name == "mast":
        return Camera(add(base, MAST_CAMERA_OFFSET), add(base, MAST_TARGET))
    if name == "hand":
        ahead, above = HAND_CAMERA_OFFSET
        eye = add(tool, (ahead * cos(yaw), ahead * sin(yaw), above))
        below = add(eye, (0.0, 0.0, -1.0))
        return Camera(eye, below, up=(cos(yaw), sin(yaw), 0.0), field_of_view=70.0)
    raise KeyError(name)


class LastDetection(NamedTuple):
    """The can as seen in the last picture.

    Attributes:
        place: its position in W, m.
        time: plant time of the picture, s.
    """

    place: Vector3
    time: float


def station_for(station: Vector3, seen: LastDetection | None) -> Vector3:
    """Return where the arm's base should be to pick the can.

    Args:
        station: position of the arm's base at the nominal station, in W, m.
        seen: the last detection of the can, if any.

    Returns:
        The station, unless the can was seen out of reach from there; then the place on the floor from which
        it is in reach, in W, m.
    """
    if seen is None:
        return station
    away, aside = dist(seen.place[:2], station[:2]), abs(seen.place[1] - station[1])
    if GRASP_REACH[0] <= away <= GRASP_REACH[1] and aside <= MAX_LATERAL_OFFSET:
        return station
    (west, east), (south, north) = FLOOR_BOUNDS
    x, y = seen.place[0] - STATION_TO_STAND, seen.place[1]
    return (min(east, max(west, x)), min(north, max(south, y)), station[2])


def room_measurements(
    layout: RoomLayout, base: Vector3, held: bool, seen: LastDetection | None, time: float
) -> dict[str, Any]:
    """Return station, delivery place and the task's predicates, without `object_delivered`.

    `object_detected` holds for `MAX_DETECTION_AGE` seconds after a picture that shows the can, and while it
    is felt in the hand: an interrupted delivery need not look for what it carries. `delivery_position` is
    where the can's middle belongs.

    Args:
        layout: initial positions.
        base: position of the arm's base in W, m.
        held: True if the can is felt in the hand.
        seen: the can in the last picture; None if it was not in it, or has been held since.
        time: now, s.

    Returns:
        Values by vocabulary name, SI, positions in W.
    """
    fresh = seen if seen is not None and time - seen.time <= MAX_DETECTION_AGE else None
    station = station_for(layout.station, fresh)
    return {
        "station_position": station,
        "delivery_position": layout.delivery,
        "robot_at_target": dist(base[:2], station[:2]) < STATION_TOLERANCE,
        "object_detected": fresh is not None or held,
        "object_grasped": held,
    }


def camera_measurements(camera: str, found: DetectedObject | None, delivery: Vector3) -> dict[str, Any]:
    """Return what a picture shows of the can.

    Only the mast camera sees if there is room for a hand around it, and if it is where it belongs, upright
    or lying.

    Args:
        camera: `mast` or `hand`.
        found: the can; None if it is not in the picture.
        delivery: goal position of the can's middle, in W, m.

    Returns:
        Values by vocabulary name, SI, positions in W; None for what is no longer known.
    """
    if found is None:
        return {"object_delivered": False} if camera == "mast" else {}
    seen: dict[str, Any] = {"object_position": found.position, "object_lying": found.axis is not None}
    if found.axis is not None:
        seen["object_yaw"] = found.axis
    if camera == "mast":
        # None removes an earlier detection: the picture no longer shows it.
        seen["object_push_start"], seen["object_push_way"] = found.push or (None, None)
        dx, dy, dz = subtract(found.position, delivery)
        lies = CAN_SIZE[0] - CAN_SIZE[1] / 2 if found.axis is not None else 0.0
        seen |= {
            "object_free": found.grip_yaw is not None,
            "object_yaw": found.axis or found.grip_yaw or 0.0,
            "object_delivered": hypot(dx, dy) < DELIVERY_TOLERANCE and abs(dz - lies) < 0.01,
        }
    return seen
