"""Room for an open hand that comes down on a piece: nothing else may be under the hand."""

from math import cos, sin
from typing import NamedTuple

import numpy as np

from aeros.perception import Points

Place = tuple[float, float, float]


class HandPart(NamedTuple):
    """A part of the open hand, on both sides of the tool point.

    Attributes:
        thick: how far it reaches along the hand's heading, m.
        wide: from where to where it reaches along the way of the fingers, m.
        from_height: height of its lower end over the tool point, m.
    """

    thick: float
    wide: tuple[float, float]
    from_height: float


OPEN_HAND = (HandPart(0.035, (0.0, 0.105), 0.034), HandPart(0.013, (0.036, 0.064), -0.009))
"""Palm and fingers, 80 mm apart; with some millimetres to spare."""

IN_THE_WAY = 4
"""Number of points from which something is in the hand's way: fewer are noise."""


def has_room(points: Points, place: Place, yaw: float) -> bool:
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
