"""The rectangle of least area around points: position and heading of an object with straight sides."""

from __future__ import annotations

from math import pi
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

TOP_FACE_DEPTH: Final = 0.004
"""Depth below the highest point that still belongs to the top face, m."""

_HEADINGS: Final = np.arange(0.0, pi / 2.0, pi / 360.0)
"""Headings to try, rad: half a degree is finer than a picture of a hundred pixels resolves."""


class Rectangle(NamedTuple):
    """A rectangle in the x, y plane.

    Attributes:
        x: of its middle, m.
        y: of its middle, m.
        heading: of its length, rad in [0, π/2).
        length: m.
        width: across the length, m; it may be the longer side.
    """

    x: float
    y: float
    heading: float
    length: float
    width: float

    @property
    def longer_heading(self) -> float:
        """Heading of the longer side, rad in [0, π); that of the length if both are equal."""
        return self.heading if self.length >= self.width else self.heading + pi / 2.0

    @property
    def shorter_heading(self) -> float:
        """Heading of the shorter side, rad in [0, π); that of the width if both are equal."""
        return self.heading + pi / 2.0 if self.length >= self.width else self.heading


def min_area_rectangle(points: NDArray[np.float64]) -> Rectangle:
    """Find the rectangle of least area around points, to half a degree.

    Args:
        points: x and y (n, 2), n > 0, m.

    Returns:
        The rectangle.
    """
    ways = np.stack((np.cos(_HEADINGS), np.sin(_HEADINGS)))
    along = points @ ways
    across = points @ np.stack((-ways[1], ways[0]))
    lengths, widths = np.ptp(along, axis=0), np.ptp(across, axis=0)
    best = int(np.argmin(lengths * widths))
    u = float(along[:, best].min() + along[:, best].max()) / 2.0
    v = float(across[:, best].min() + across[:, best].max()) / 2.0
    c, s = (float(part) for part in ways[:, best])
    return Rectangle(
        u * c - v * s,
        u * s + v * c,
        float(_HEADINGS[best]),
        float(lengths[best]),
        float(widths[best]),
    )


_POINTS_PER_OUTLIER: Final = 25
"""Number of points of which one may be higher than all others and is not of the thing."""


def top_points(points: NDArray[np.float64], depth: float = TOP_FACE_DEPTH) -> NDArray[np.float64]:
    """Select the highest of some points, but for single ones that are higher than all others.

    Their level is that of the highest point after one in 25 is left out: so a single wrong pixel of a thing
    that has 25 or more does not decide.

    Args:
        points: (n, 3), n > 0, m.
        depth: greatest distance from that level, exclusive, m.

    Returns:
        The points (m, 3) less than `depth` below or above the level, m; m > 0.
    """
    heights = np.sort(points[:, 2])
    level = heights[len(heights) - 1 - len(heights) // _POINTS_PER_OUTLIER]
    highest: NDArray[np.float64] = points[np.abs(points[:, 2] - level) < depth]
    return highest


def upper_points(points: NDArray[np.float64], depth: float = TOP_FACE_DEPTH) -> NDArray[np.float64]:
    """Select the points of the upper side of a thing, although depth is noisy.

    The level of that side is the 90th percentile of all heights, q90, and the noise adds q99 - q90 below it:
    with a standard deviation of the noise of 5 mm, 9 of 10 points of a level face are selected, whereas the
    highest point alone would be 15 mm too high. At least a fifth of the points should be of that side.

    Args:
        points: (n, 3), n > 0, m.
        depth: greatest depth below the upper side's level, without noise, m.

    Returns:
        The points (m, 3) above q90 - depth - (q99 - q90), m; m > 0.
    """
    level, highest = np.quantile(points[:, 2], (0.90, 0.99))
    upper: NDArray[np.float64] = points[points[:, 2] > level - depth - (highest - level)]
    return upper


def top_face(points: NDArray[np.float64], depth: float = TOP_FACE_DEPTH) -> tuple[Rectangle, float]:
    """Find the rectangle around the highest of some points.

    Args:
        points: (n, 3), n > 0, m.
        depth: greatest depth of the face below the highest point, m.

    Returns:
        The rectangle around the points at most `depth` below the highest, and their median height, m.
    """
    face = top_points(points, depth)
    return min_area_rectangle(face[:, :2]), float(np.median(face[:, 2]))


def has_size(rectangle: Rectangle, length: float, width: float, tolerance: float) -> bool:
    """Check the size of a rectangle, whichever side is called its length.

    Args:
        rectangle: a rectangle.
        length: expected longer side, m.
        width: expected shorter side, m.
        tolerance: greatest difference of each side, m.

    Returns:
        True if both sides are as expected.
    """
    longer, shorter = sorted((rectangle.length, rectangle.width), reverse=True)
    return abs(longer - length) <= tolerance and abs(shorter - width) <= tolerance


def wrap_heading(heading: float, period: float) -> float:
    """Wrap the heading of an object that looks the same when rotated by a period.

    Args:
        heading: rad.
        period: angle of the symmetry, rad.

    Returns:
        The equivalent heading in [-period/2, period/2), rad.
    """
    return (heading + period / 2.0) % period - period / 2.0
