"""A camera's error, from pictures of the robot's own hand: the robot knows where its hand is.

Some face of a hand or wrist that is flat, level and round shows in pictures from above where it is, whatever
its colour. Seen at several places, it tells how far the camera is displaced, and turned about the vertical;
the tilt of a camera is found from a level ground (`level_ground`). So a pose of a camera is corrected in all
six ways. Units: m, rad. Frame: W, as the robot's joints and base have it.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, cos, sin, sqrt
from typing import Final, NamedTuple

import numpy as np

from aeros.perception.components import largest_component
from aeros.perception.points import Mask, Points, Vector3

_FACE_DEPTH: Final = 0.006
"""Greatest distance of a face's points from its height, m: three times the noise of depth."""

_LEAST_SHARE: Final = 0.5
"""Least visible share of a face: less of it does not show where its middle is."""

_LEAST_LEVEL: Final = 0.3
"""Least number of points of a level over that of the level with most: what is lower may be larger."""

_OUTLIER: Final = 0.006
"""Distance from its fitted place from which a place is left out, m."""

_LEAST_PLACES: Final = 4
"""Least number of places: two would do, and the others show how well the fit is."""

_LEAST_SPREAD: Final = 0.1
"""Least root mean square distance of the places from their middle, level, m: 2 mm off in each are 1° then."""


class CameraError(NamedTuple):
    """Correction of what a picture shows: a turn about the vertical through W's origin, then a shift.

    Attributes:
        turn: about the vertical, rad.
        shift: m.
        residual: root mean square distance of the hand from where the corrected picture shows it, m.
        places: number of places of the hand.
    """

    turn: float
    shift: Vector3
    residual: float
    places: int


def find_level_disc(points: Points, expected: Vector3, radius: float, within: float) -> Vector3 | None:
    """Find a round level face that is higher than all around it.

    Args:
        points: of every pixel (height, width, 3), m, of a level picture.
        expected: where its middle should be, m.
        radius: of the face, m.
        within: greatest distance from there, level and in height, m.

    Returns:
        Its middle, m; None if there is no such face, or less than half of it is visible.
    """
    off = points - np.array(expected)
    near = (np.hypot(off[:, :, 0], off[:, :, 1]) < within + radius) & (np.abs(off[:, :, 2]) < within)
    if not near.any():
        return None
    heights = np.sort(points[near][:, 2])
    count = np.searchsorted(heights, heights + 2.0 * _FACE_DEPTH, "right") - np.arange(len(heights))
    highest = float(heights[np.nonzero(count >= _LEAST_LEVEL * count.max())[0][-1]])
    level = float(np.median(heights[np.abs(heights - highest) <= 2.0 * _FACE_DEPTH]))
    face = largest_component(near & (np.abs(points[:, :, 2] - level) < _FACE_DEPTH))
    seen = points[face]
    low, high = np.percentile(seen[:, :2], (1.0, 99.0), axis=0)
    width, length = (high - low).tolist()
    if min(width, length) < 2.0 * radius * _LEAST_SHARE or max(width, length) > 3.0 * radius:
        return None
    if _is_at_the_edge(face):
        return None
    x, y = ((low + high) / 2.0).tolist()
    return (x, y, float(np.median(seen[:, 2])))


def fit_camera_error(seen: Sequence[Vector3], known: Sequence[Vector3]) -> CameraError | None:
    """Fit a turn about the vertical and a shift: the sum of squared distances is least.

    A place that is far off its fitted place is left out, and the rest is fitted again.
    Source: Umeyama, Least-squares estimation of transformation parameters, IEEE PAMI 13(4), 1991, in the
    plane.

    Args:
        seen: places of the hand in pictures, m.
        known: the same places as the joints have them, m.

    Returns:
        The error; None if the places are fewer than four, or too near to each other.
    """
    p, q = np.array(seen, np.float64), np.array(known, np.float64)
    for _ in range(len(seen)):
        if len(p) < _LEAST_PLACES:
            return None
        a, b = p - p.mean(axis=0), q - q.mean(axis=0)
        if sqrt(float((b[:, :2] ** 2).sum()) / len(b)) < _LEAST_SPREAD:
            return None
        turn = atan2(float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum()), float((a[:, :2] * b[:, :2]).sum()))
        turned = p @ _about_vertical(turn).T
        shift = (q - turned).mean(axis=0)
        off = np.linalg.norm(turned + shift - q, axis=1)
        worst = int(np.argmax(off))
        if off[worst] <= _OUTLIER or len(p) == _LEAST_PLACES:
            x, y, z = shift.tolist()
            return CameraError(turn, (x, y, z), sqrt(float((off**2).mean())), len(p))
        p, q = np.delete(p, worst, axis=0), np.delete(q, worst, axis=0)
    return None


def correct_points(points: Points, turn: float, shift: Vector3) -> Points:
    """Correct points of a camera with a known error.

    Args:
        points: (..., 3), m.
        turn: of a `CameraError`, rad.
        shift: of it, m.

    Returns:
        The points as they are in W (..., 3), m.
    """
    corrected: Points = points @ _about_vertical(turn).T + np.array(shift)
    return corrected


def _about_vertical(turn: float) -> Points:
    c, s = cos(turn), sin(turn)
    return np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))


def _is_at_the_edge(mask: Mask) -> bool:
    """Return True if a mask is cut off by the picture's edge, so that its middle is not seen."""
    return bool(mask[0].any() or mask[-1].any() or mask[:, 0].any() or mask[:, -1].any())
