"""Contact of the robot's links with each other, for simulators without physics.

It takes the corners of the links' hulls without their radius. These lie inside the links, so a contact that
is reported is one; links that overlap by less than their radii, 10 mm together, may not be noticed.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import dist
from typing import Final

import numpy as np

from aeros.kinematic_chain import JointFrame, Triple, frames_of, mounting_of, pairs_that_may_meet
from aeros.sim.robot.body import PANDA_BODY
from aeros.sim.robot.limits import Vector

_MAX_STEPS: Final = 30
"""Greatest number of directions to try for two links."""

_CONTACT: Final = 1e-3
"""Distance of two links' corners at which they count as touching, m."""


def find_self_contact(q: Sequence[float]) -> tuple[str, str] | None:
    """Search for two links that touch.

    Args:
        q: joint positions (7), rad.

    Returns:
        The names of the links, or None if no two touch.
    """
    frames = frames_of(_MOUNTINGS, q)
    middles = {hull.link: frames[hull.joint].to_base(_MIDDLES[hull.link]) for hull in PANDA_BODY.hulls}
    corners: dict[str, Vector] = {}
    for inner, outer in _PAIRS:
        if dist(middles[inner], middles[outer]) >= _REACHES[inner] + _REACHES[outer]:
            continue
        for link in (inner, outer):
            if link not in corners:
                corners[link] = _to_base(frames[_JOINTS[link]], link)
        if _touch(corners[inner], corners[outer]):
            return inner, outer
    return None


def _to_base(frame: JointFrame, link: str) -> Vector:
    points: Vector = _CORNERS[link] @ np.array((frame.x, frame.y, frame.z)) + np.array(frame.origin)
    return points


def _touch(a: Vector, b: Vector) -> bool:
    """Return True if the convex hulls of two sets of points (n, 3) touch, by Gilbert's algorithm."""
    way = b[0] - a[0]
    for _ in range(_MAX_STEPS):
        along_a, along_b = a @ way, b @ way
        if along_b.min() > along_a.max():
            return False
        step = b[along_b.argmin()] - a[along_a.argmax()] - way
        share = -(way @ step) / max(step @ step, 1e-18)
        way = way + min(max(share, 0.0), 1.0) * step
        if way @ way < _CONTACT**2:
            return True
    return False


_MOUNTINGS: Final = tuple(mounting_of(row) for row in PANDA_BODY.dh_rows)
_PAIRS: Final = tuple(
    (inner.link, outer.link)
    for inner, outer in pairs_that_may_meet(PANDA_BODY.hulls, PANDA_BODY.exempt_pairs)
)
_CORNERS: Final = {hull.link: np.array(hull.corners) for hull in PANDA_BODY.hulls}
_JOINTS: Final = {hull.link: hull.joint for hull in PANDA_BODY.hulls}
_MIDDLES: Final[dict[str, Triple]] = {
    link: tuple(points.mean(axis=0).tolist()) for link, points in _CORNERS.items()
}
"""Mean of each link's corners, in its joint's frame, m."""

_REACHES: Final = {
    link: float(np.linalg.norm(points - points.mean(axis=0), axis=1).max())
    for link, points in _CORNERS.items()
}
"""Greatest distance of each link's corners from their mean, m."""
