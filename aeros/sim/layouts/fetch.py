"""Meaning of pictures of a room in which a can is fetched.

Skills learn from pictures alone where the can is, and so if it is delivered; the fingers feel if it is held.
Not modelled: obstacles on the way.
"""

from __future__ import annotations

from math import dist, hypot
from typing import Any, Final, NamedTuple

from aeros.sim.detected_object import DetectedObject
from aeros.sim.geometry import Vector3, subtract

STATION_TO_STAND: Final = 0.58
"""Distance of the stand's middle from the arm's base at the station, m."""

CAN_SIZE: Final = (0.022, 0.08)
"""Radius and height of the can, m."""

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
    station: Vector3, base: Vector3, held: bool, seen: LastDetection | None, time: float
) -> dict[str, Any]:
    """Return the station and the task's predicates, without `object_delivered`.

    `object_detected` holds for `MAX_DETECTION_AGE` seconds after a picture that shows the can, and while it
    is felt in the hand: an interrupted delivery need not look for what it carries.

    Args:
        station: position of the arm's base at the nominal station, in W, m.
        base: position of the arm's base in W, m.
        held: True if the can is felt in the hand.
        seen: the can in the last picture; None if it was not in it, or has been held since.
        time: now, s.

    Returns:
        Values by vocabulary name, SI, positions in W.
    """
    fresh = seen if seen is not None and time - seen.time <= MAX_DETECTION_AGE else None
    station = station_for(station, fresh)
    return {
        "station_position": station,
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
