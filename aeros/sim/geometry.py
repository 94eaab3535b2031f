"""Points, poses and cameras in W, in plain numbers: what scenes are laid out in, whatever simulates them.

SI units; quaternions x, y, z, w.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

Vector3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

UPRIGHT: Final[Quaternion] = (0.0, 0.0, 0.0, 1.0)


class Pose(NamedTuple):
    """Where a body is: position in W, m, and orientation."""

    position: Vector3
    orientation: Quaternion


@dataclass(frozen=True, slots=True)
class Camera:
    """A pinhole camera in W: eye, point looked at, up, vertical field of view in degrees, pixels."""

    eye: Vector3
    target: Vector3
    up: Vector3 = (0.0, 0.0, 1.0)
    field_of_view: float = 50.0
    width: int = 320
    height: int = 240
    near: float = 0.02
    far: float = 5.0


def add(a: Vector3, b: Vector3) -> Vector3:
    """The sum of two vectors."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def subtract(a: Vector3, b: Vector3) -> Vector3:
    """The difference of two vectors."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def cross(a: Vector3, b: Vector3) -> Vector3:
    """The cross product of two vectors."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def yaw_of(orientation: Sequence[float]) -> float:
    """Heading of a body's x axis in the x, y plane of W, rad in (-π, π]."""
    x, y, z, w = orientation
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def yaw_orientation(yaw: float) -> Quaternion:
    """The orientation of a body turned by `yaw` about z of W."""
    return (0.0, 0.0, math.sin(yaw / 2.0), math.cos(yaw / 2.0))


def to_world(frame: Pose, point: Vector3) -> Vector3:
    """Where in W a point given in `frame` is."""
    return add(frame.position, _rotated(frame.orientation, point))


def to_frame(frame: Pose, point: Vector3) -> Vector3:
    """Where in `frame` a point given in W is."""
    x, y, z, w = frame.orientation
    return _rotated((-x, -y, -z, w), subtract(point, frame.position))


def _rotated(q: Quaternion, point: Vector3) -> Vector3:
    """V + 2·w·(r × v) + 2·r × (r × v), for the unit quaternion (r, w)."""
    r, w = q[:3], q[3]
    once = cross(r, point)
    twice = cross(r, once)
    x, y, z = (v + 2.0 * (w * a + b) for v, a, b in zip(point, once, twice, strict=True))
    return (x, y, z)


def is_in_view(camera: Camera, point: Vector3) -> bool:
    """Whether `point` is in the picture that `camera` takes, if nothing is before it."""
    forward = _unit(subtract(camera.target, camera.eye))
    right = _unit(cross(forward, camera.up))
    up = cross(right, forward)
    away = subtract(point, camera.eye)
    depth, x, y = (sum(a * b for a, b in zip(away, axis, strict=True)) for axis in (forward, right, up))
    half = math.tan(math.radians(camera.field_of_view) / 2.0) * depth
    within = abs(y) <= half and abs(x) <= half * camera.width / camera.height
    return camera.near < depth < camera.far and within


def _unit(v: Vector3) -> Vector3:
    length = math.hypot(*v)
    return (v[0] / length, v[1] / length, v[2] / length)
