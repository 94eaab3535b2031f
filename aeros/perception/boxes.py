"""Boxes of known size on any of their faces, from the points on them that a camera sees from above."""

from __future__ import annotations

from itertools import combinations
from math import pi
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeros.perception.points import Vector3
from aeros.perception.rectangles import min_area_rectangle, upper_points, wrap_heading

_SQUARE_WITHIN: Final = 0.003
"""Difference of two sides up to which a hand can close on either, m: a pixel of a camera 1 m away."""


class BoxPose(NamedTuple):
    """Pose of a box that rests on a face.

    Attributes:
        position: its middle, m.
        headings: headings along its upper side, across which the box is narrowest, rad in [-π/2, π/2): one,
            or two if the upper side is a square.
        height: m.
        top: height of its upper side, m.
    """

    position: Vector3
    headings: tuple[float, ...]
    height: float
    top: float


def locate_box(points: NDArray[np.float64], size: tuple[float, ...]) -> BoxPose:
    """Locate a box of known size that rests on a face.

    The rectangle around its highest points tells which face is up, and so how high the box is. Assumes that
    its upper side is visible and level.

    Args:
        points: on the box (n, 3), n ≥ 1, in W, m.
        size: lengths of its edges, m.

    Returns:
        The box in W.
    """
    face = upper_points(points)
    rectangle, level = min_area_rectangle(face[:, :2]), float(np.median(face[:, 2]))
    seen = sorted((rectangle.length, rectangle.width))
    sides = min(
        (sorted(pair) for pair in combinations(sorted(size), 2)),
        key=lambda pair: sum(abs(a - b) for a, b in zip(pair, seen, strict=True)),
    )
    height = sum(size) - sum(sides)
    longer = wrap_heading(rectangle.longer_heading, pi)
    headings: tuple[float, ...] = (longer,)
    if sides[1] - sides[0] <= _SQUARE_WITHIN:
        # Seen from above, a square has no longer side: the smaller turn of the hand comes first.
        first = wrap_heading(rectangle.heading, pi / 2.0)
        headings = (first, wrap_heading(first + pi / 2.0, pi))
    return BoxPose((rectangle.x, rectangle.y, level - height / 2.0), headings, height, level)
