"""Room for the hand: the parts of it, and the points that would be in their way."""

from math import cos, pi, sin
from typing import NamedTuple

import numpy as np

from aeros.perception import Points

from .measures import LOWEST, MIN_PATCH, Place

GRASPS = ((0.28, 0.62), (-0.36, 0.37))
"""Bounds of the tool along x and y, m."""

REACH = ((0.31, 0.62), (-0.36, 0.37), (-0.03, 0.20))
"""Bounds of a thing that the hand can grip, or push to such a place, along x, y and z, m."""

MOST_HEADING = 1.7
"""Greatest heading of a hand that grips, rad."""


class HandPart(NamedTuple):
    """A part of the hand, on both sides of the tool point.

    Attributes:
        thick: how far it reaches along the hand's heading, m.
        wide: from where to where it reaches along the way of the fingers, m.
        from_height: height of its lower end over the tool point, m.
    """

    thick: float
    wide: tuple[float, float]
    from_height: float


PALM = HandPart(0.037, (-1.0, 0.107), 0.036)


OPEN_HAND = (PALM, HandPart(0.014, (0.024, 0.058), -0.009))


CLOSED_HAND = (PALM, HandPart(0.014, (-1.0, 0.018), -0.009))
"""A hand with its fingers open, or together; with some millimetres to spare."""


def is_within_reach(place: Place) -> bool:
    """Return True if the hand, or a push towards it, can reach a thing there."""
    return all(low < at < high for at, (low, high) in zip(place, REACH, strict=True))


def square_headings(yaw: float) -> tuple[float, ...]:
    """Return the headings at which a hand may grip a thing that is square."""
    return tuple(one for one in (yaw, yaw + pi / 2.0, yaw - pi / 2.0) if abs(one) <= MOST_HEADING)


def in_frame(points: Points, middle: Place, yaw: float) -> tuple[Points, Points]:
    """Return how far points (n, 3) are from a place along a heading, and across it, each (n,)."""
    away = points[:, :2] - np.array(middle[:2])
    return away @ np.array((cos(yaw), sin(yaw))), away @ np.array((-sin(yaw), cos(yaw)))


def has_room(points: Points, place: Place, yaw: float, hand: tuple[HandPart, ...] = OPEN_HAND) -> bool:
    """Return True if a hand at `yaw` that grips at a place meets none of points (n, 3), nor the carriage."""
    x, y, z = place[0], place[1], max(place[2], LOWEST)
    if not (GRASPS[0][0] < x < GRASPS[0][1] and GRASPS[1][0] < y < GRASPS[1][1]):
        return False
    along, across = in_frame(points, place, yaw)
    along, across, above = np.abs(along), np.abs(across), points[:, 2] - z
    return not any(
        (
            (along < part.thick)
            & (across > part.wide[0])
            & (across < part.wide[1])
            & (above > part.from_height)
        ).sum()
        >= MIN_PATCH
        for part in hand
    )
