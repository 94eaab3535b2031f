"""Points, poses and cameras in W, in plain numbers: what scenes are laid out in, whatever simulates them.

SI units; quaternions x, y, z, w.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

Triple = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

UPRIGHT: Final[Quaternion] = (0.0, 0.0, 0.0, 1.0)


class Pose(NamedTuple):
    """Where a body is: position in W, m, and orientation."""

    position: Triple
    orientation: Quaternion


@dataclass(frozen=True, slots=True)
class Camera:
    """A pinhole camera in W: eye, point looked at, up, vertical field of view in degrees, pixels."""

    eye: Triple
    target: Triple
    up: Triple = (0.0, 0.0, 1.0)
    field_of_view: float = 50.0
    width: int = 320
    height: int = 240
    near: float = 0.02
    far: float = 5.0


def plus(a: Triple, b: Triple) -> Triple:
    """The sum of two vectors."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def minus(a: Triple, b: Triple) -> Triple:
    """The difference of two vectors."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def cross(a: Triple, b: Triple) -> Triple:
    """The cross product of two vectors."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def yaw_of(orientation: Sequence[float]) -> float:
    """Heading of a body's x axis in the x, y plane of W, rad in (-π, π]."""
    x, y, z, w = orientation
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def turned(yaw: float) -> Quaternion:
    """The orientation of a body turned by `yaw` about z of W."""
    return (0.0, 0.0, math.sin(yaw / 2.0), math.cos(yaw / 2.0))


def of_frame(frame: Pose, point: Triple) -> Triple:
    """Where in W a point given in `frame` is."""
    return plus(frame.position, _rotated(frame.orientation, point))


def in_frame(frame: Pose, point: Triple) -> Triple:
    """Where in `frame` a point given in W is."""
    x, y, z, w = frame.orientation
    return _rotated((-x, -y, -z, w), minus(point, frame.position))


def _rotated(q: Quaternion, point: Triple) -> Triple:
    """V + 2·w·(r × v) + 2·r × (r × v), for the unit quaternion (r, w)."""
    r, w = q[:3], q[3]
    once = cross(r, point)
    twice = cross(r, once)
    x, y, z = (v + 2.0 * (w * a + b) for v, a, b in zip(point, once, twice, strict=True))
    return (x, y, z)


def in_view(camera: Camera, point: Triple) -> bool:
    """Whether `point` is in the picture that `camera` takes, if nothing is before it."""
    forward = _unit(minus(camera.target, camera.eye))
    right = _unit(cross(forward, camera.up))
    up = cross(right, forward)
    away = minus(point, camera.eye)
    depth, x, y = (sum(a * b for a, b in zip(away, axis, strict=True)) for axis in (forward, right, up))
    half = math.tan(math.radians(camera.field_of_view) / 2.0) * depth
    within = abs(y) <= half and abs(x) <= half * camera.width / camera.height
    return camera.near < depth < camera.far and within


def _unit(v: Triple) -> Triple:
    length = math.hypot(*v)
    return (v[0] / length, v[1] / length, v[2] / length)
