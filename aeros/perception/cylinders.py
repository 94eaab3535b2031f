"""Cylinders of known size that stand or lie, from the points on them that a camera sees from above."""

from __future__ import annotations

from math import atan2, pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeros.perception.points import Vector3
from aeros.perception.rectangles import upper_points, wrap_heading

Points = NDArray[np.float64]


class CylinderPose(NamedTuple):
    """Pose of a cylinder that stands or lies.

    Attributes:
        position: its middle, m.
        heading: of its axis if it lies, rad in [-π, π], in either of its two directions; None if it stands.
        top: height below which 99 % of its points are, m: single points may be noise.
    """

    position: Vector3
    heading: float | None
    top: float

    @property
    def axis(self) -> float | None:
        """Heading of its axis if it lies, rad in [-π/2, π/2); None if it stands."""
        return None if self.heading is None else wrap_heading(self.heading, pi)


def locate_cylinder(points: Points, radius: float, height: float) -> CylinderPose:
    """Locate a cylinder of known size that stands or lies.

    Its highest points show its pose: a disc if it stands, a strip as long as the cylinder if it lies. They
    also give the middle: the visible side is the camera's side, so the middle of all points would be biased
    towards the camera. Assumes that its upper side is visible.

    Args:
        points: on the cylinder (n, 3), n ≥ 2, in W, m.
        radius: m.
        height: m; more or less than the diameter, so that the two poses differ.

    Returns:
        The cylinder in W.
    """
    top = float(np.quantile(points[:, 2], 0.99))
    face = upper_points(points)
    level = float(np.median(face[:, 2]))
    along = _principal_direction(face[:, :2])
    low, high = _extent(face[:, :2], along)
    longer, shorter = sorted((high - low).tolist(), reverse=True)
    between = (2.0 * radius + height) / 2.0
    # A flat one that lies is as long as its diameter, and its axis is the shorter side.
    is_flat = height < 2.0 * radius
    lies = shorter < between if is_flat else longer > between
    heading = atan2(along[1], along[0]) + (pi / 2.0 if is_flat else 0.0) if lies else None
    if not lies:
        along = np.array((1.0, 0.0))
        low, high = _extent(face[:, :2], along)
    u, v = (low + high) / 2.0
    x, y = u * along + v * np.array((-along[1], along[0]))
    return CylinderPose((float(x), float(y), level - (radius if lies else height / 2.0)), heading, top)


def _principal_direction(points: Points) -> Points:
    """Return the unit direction in which `points` (n, 2) spread most."""
    away = points - points.mean(axis=0)
    _, vectors = np.linalg.eigh(away.T @ away)
    longest: Points = vectors[:, -1]
    return longest


def _extent(points: Points, along: Points) -> Points:
    """Return least and greatest coordinates of `points` (n, 2) along and across a direction: (2, 2)."""
    turned = points @ np.array((along, (-along[1], along[0]))).T
    return np.array((turned.min(axis=0), turned.max(axis=0)))
