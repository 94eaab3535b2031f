"""The rectangle of least area around points: where a thing with straight sides is, and how it is turned."""

from __future__ import annotations

from math import pi
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeros.sim.perception.detection import TOP_FACE_DEPTH

_HEADINGS: Final = np.arange(0.0, pi / 2.0, pi / 360.0)
"""Those that are tried, rad: half a degree is finer than a picture of a hundred pixels shows."""


class Rectangle(NamedTuple):
    """Its middle, m; the heading of its length in [0, π/2), rad; length along and width across that, m."""

    x: float
    y: float
    heading: float
    length: float
    width: float


def min_area_rectangle(points: NDArray[np.float64]) -> Rectangle:
    """The rectangle of least area around `points` (n, 2), n > 0."""
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
    """The rectangle around what is highest of `points` (n, 3), n > 0, and its height, m."""
    face = points[points[:, 2] > points[:, 2].max() - TOP_FACE_DEPTH]
    return min_area_rectangle(face[:, :2]), float(np.median(face[:, 2]))


def wrap_heading(heading: float, period: float) -> float:
    """The same heading of what looks alike when turned by `period`, within half a period of 0."""
    return (heading + period / 2.0) % period - period / 2.0
