"""The robot's own hand in pictures, which shows how far off a camera is."""

from collections.abc import Mapping
from math import dist, inf
from typing import Any, NamedTuple

import numpy as np

from aeros.perception import (
    CameraError,
    Level,
    Mask,
    Points,
    correct_points,
    estimate,
    find_level_disc,
    fit_camera_error,
)

from .places import Place

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

NEW_PLACE = 0.05
"""Distance of two places of the hand that tell more than one, m."""

PLACES = 12
"""Number of places of the hand that are remembered; the oldest is forgotten first."""

TRUSTED_RESIDUAL = 0.005
"""Greatest residual of a camera's error, m: one with more is not applied."""

HAND_ROOM = (0.15, 0.05)
"""Radius around the tool, and depth below it, of the hand and of what it holds, m."""

HAND_LOWEST = 0.12
"""Height below which the hand counts as something in the way, m: it hides what is there."""


class OwnHand(NamedTuple):
    """The robot's own hand in pictures: seen and known places, and the camera's error that they show.

    `base` is the arm's base meanwhile. `is_off` if the last picture shows the hand where it is not, and so
    all else, too.
    """

    base: Place | None
    places: list[tuple[Place, Place]]
    error: CameraError | None
    is_off: bool


def watch_hand(hand: OwnHand, level: Level, readings: Mapping[str, Any]) -> OwnHand:
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


def camera_values(hand: OwnHand) -> dict[str, Any]:
    """Return what is known of the camera's error."""
    values: dict[str, Any] = {"overhead_off": hand.is_off}
    if hand.error is not None:
        values["overhead_turn"] = estimate(hand.error.turn, 0.01)
        values["overhead_shift"] = estimate(hand.error.shift, hand.error.residual)
        values["overhead_residual"] = estimate(hand.error.residual, 0.001)
    return values


def is_hand(points: Points, tool: Place | None) -> Mask:
    """Find the points of the robot's own hand and of what it holds, if it is over the table."""
    x, y, z = tool or (0.0, 0.0, inf)
    radius, depth = HAND_ROOM
    near = np.hypot(points[:, :, 0] - x, points[:, :, 1] - y) < radius
    hand: Mask = near & (points[:, :, 2] > max(z - depth, HAND_LOWEST))
    return hand
