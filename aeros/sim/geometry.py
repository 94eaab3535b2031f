"""Points, poses and cameras in W as plain numbers: the geometry that all simulators share.

SI units; quaternions are (x, y, z, w).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, NamedTuple

Vector3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

UPRIGHT: Final[Quaternion] = (0.0, 0.0, 0.0, 1.0)


class Pose(NamedTuple):
    """Pose of a body.

    Attributes:
        position: position of its origin in W, m.
        orientation: its orientation in W, a unit quaternion (x, y, z, w).
    """

    position: Vector3
    orientation: Quaternion


@dataclass(frozen=True, slots=True)
class Camera:
    """A pinhole camera in W.

    Attributes:
        eye: its position, m.
        target: the point that it looks at, m.
        up: the direction that is up in the picture.
        field_of_view: vertical, degrees.
        width: of the picture, pixels.
        height: of the picture, pixels.
        near: depth of the nearest visible point, m.
        far: depth of the farthest visible point, m.
    """

    eye: Vector3
    target: Vector3
    up: Vector3 = (0.0, 0.0, 1.0)
    field_of_view: float = 50.0
    width: int = 320
    height: int = 240
    near: float = 0.02
    far: float = 5.0


def add(a: Vector3, b: Vector3) -> Vector3:
    """Add two vectors.

    Args:
        a: a vector.
        b: a vector in the same frame and unit.

    Returns:
        a + b.
    """
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def subtract(a: Vector3, b: Vector3) -> Vector3:
    """Subtract two vectors.

    Args:
        a: a vector.
        b: a vector in the same frame and unit.

    Returns:
        a - b.
    """
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def cross(a: Vector3, b: Vector3) -> Vector3:
    """Compute the cross product of two vectors.

    Args:
        a: a vector.
        b: a vector in the same frame.

    Returns:
        a × b.
    """
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def yaw_of(orientation: Sequence[float]) -> float:
    """Compute the heading of a body's x axis in the x, y plane of W.

    Args:
        orientation: unit quaternion (x, y, z, w) from the body's frame to W.

    Returns:
        The heading, rad in (-π, π].
    """
    x, y, z, w = orientation
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def yaw_orientation(yaw: float) -> Quaternion:
    """Compute the orientation of a body that is turned about z of W.

    Args:
        yaw: the angle, rad.

    Returns:
        The unit quaternion (x, y, z, w).
    """
    return (0.0, 0.0, math.sin(yaw / 2.0), math.cos(yaw / 2.0))


def to_world(frame: Pose, point: Vector3) -> Vector3:
    """Transform a point from a frame to W.

    Args:
        frame: pose of the frame in W.
        point: in `frame`, m.

    Returns:
        The point in W, m.
    """
    return add(frame.position, _rotated(frame.orientation, point))


def compose(outer: Pose, inner: Pose) -> Pose:
    """Transform a pose from a frame to W.

    Args:
        outer: pose of the frame in W.
        inner: pose in `outer`.

    Returns:
        The pose in W.
    """
    x, y, z, w = outer.orientation
    a, b, c, d = inner.orientation
    turn = (
        w * a + x * d + y * c - z * b,
        w * b - x * c + y * d + z * a,
        w * c + x * b - y * a + z * d,
        w * d - x * a - y * b - z * c,
    )
    return Pose(to_world(outer, inner.position), turn)


def to_frame(frame: Pose, point: Vector3) -> Vector3:
    """Transform a point from W to a frame.

    Args:
        frame: pose of the frame in W.
        point: in W, m.

    Returns:
        The point in `frame`, m.
    """
    (ox, oy, oz), (x, y, z, w) = frame
    return _rotated((-x, -y, -z, w), (point[0] - ox, point[1] - oy, point[2] - oz))


@lru_cache(maxsize=16)
def camera_axes(camera: Camera) -> tuple[Vector3, Vector3, Vector3]:
    """Return the unit axes of a camera in W.

    Args:
        camera: the camera.

    Returns:
        The directions that are right and up in its picture, and the one that it looks in.
    """
    ahead = _unit(subtract(camera.target, camera.eye))
    right = _unit(cross(ahead, camera.up))
    return right, cross(right, ahead), ahead


def seen_with(camera: Camera, believed: Camera, point: Vector3) -> Vector3:
    """Locate what a camera sees, from where the camera is taken to be.

    Args:
        camera: where it is.
        believed: where it is taken to be.
        point: a point in W, m.

    Returns:
        The point in W at which `believed` sees what `camera` sees at `point`, m.
    """
    away = subtract(point, camera.eye)
    x, y, z = believed.eye
    for axis, moved in zip(camera_axes(camera), camera_axes(believed), strict=True):
        along = sum(a * b for a, b in zip(axis, away, strict=True))
        x, y, z = x + along * moved[0], y + along * moved[1], z + along * moved[2]
    return (x, y, z)


def _unit(v: Vector3) -> Vector3:
    length = math.sqrt(sum(part * part for part in v))
    return (v[0] / length, v[1] / length, v[2] / length)


def _rotated(q: Quaternion, point: Vector3) -> Vector3:
    """Rotate `point` by the unit quaternion q = (r, w): v + 2·w·(r × v) + 2·r × (r × v)."""
    # Written out: simulators without physics spend a tenth of their time here.
    x, y, z, w = q
    px, py, pz = point
    a, b, c = y * pz - z * py, z * px - x * pz, x * py - y * px
    return (
        px + 2.0 * (w * a + (y * c - z * b)),
        py + 2.0 * (w * b + (z * a - x * c)),
        pz + 2.0 * (w * c + (x * b - y * a)),
    )
