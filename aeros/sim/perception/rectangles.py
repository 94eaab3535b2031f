"""The rectangle of least area around points: position and heading of an object with straight sides."""

from __future__ import annotations

from math import pi
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeros.sim.perception.detection import TOP_FACE_DEPTH

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


def top_face(points: NDArray[np.float64]) -> tuple[Rectangle, float]:
    """Find the rectangle around the highest of some points.

    Args:
        points: (n, 3), n > 0, m.

    Returns:
        The rectangle around the points at most 4 mm below the highest, and their median height, m.
    """
    face = points[points[:, 2] > points[:, 2].max() - TOP_FACE_DEPTH]
    return min_area_rectangle(face[:, :2]), float(np.median(face[:, 2]))


def wrap_heading(heading: float, period: float) -> float:
    """Wrap the heading of an object that looks the same when rotated by a period.

    Args:
        heading: rad.
        period: angle of the symmetry, rad.

    Returns:
        The equivalent heading in [-period/2, period/2), rad.
    """
    return (heading + period / 2.0) % period - period / 2.0
