"""Contact of the robot's links with each other, for simulators without physics.

It takes the corners of the links' hulls without their radius. These lie inside the links, so a contact that
is reported is one; links that overlap by less than their radii, 10 mm together, may not be noticed.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from math import dist
from typing import Final

import numpy as np

from aeros.kinematic_chain import JointFrame, Triple, frames_of, pairs_that_may_meet
from aeros.sim.robot.limits import Vector
from aeros.sim.robot.model import RobotModel

_MAX_STEPS: Final = 30
"""Greatest number of directions to try for two links."""

_CONTACT: Final = 1e-3
"""Distance of two links' corners at which they count as touching, m."""


def find_self_contact(arm: RobotModel, q: Sequence[float]) -> tuple[str, str] | None:
    """Search for two links that touch.

    Args:
        arm: the robot.
        q: joint positions, rad.

    Returns:
        The names of the links, or None if no two touch.
    """
    shapes = _shapes_of(arm)
    frames = frames_of(shapes.mountings, q)
    middles = {link: frames[joint].to_base(shapes.middles[link]) for link, joint in shapes.joints.items()}
    corners: dict[str, Vector] = {}
    for inner, outer in shapes.pairs:
        if dist(middles[inner], middles[outer]) >= shapes.reaches[inner] + shapes.reaches[outer]:
            continue
        for link in (inner, outer):
            if link not in corners:
                corners[link] = _to_base(frames[shapes.joints[link]], shapes.corners[link])
        if are_near(corners[inner], corners[outer], 0.0):
            return inner, outer
    return None


def _to_base(frame: JointFrame, corners: Vector) -> Vector:
    points: Vector = corners @ np.array((frame.x, frame.y, frame.z)) + np.array(frame.origin)
    return points


def are_near(a: Vector, b: Vector, distance: float) -> bool:
    """Search for a place where two convex hulls are near each other, by Gilbert's algorithm.

    Args:
        a: corners of one hull (n, 3), m.
        b: corners of the other hull (m, 3), in the same frame.
        distance: m.

    Returns:
        True if they are no farther apart than `distance` and 1 mm; False may be wrong for hulls that are
        farther apart than `distance` alone, or if no answer is found in 30 steps.
    """
    way = b[0] - a[0]
    for _ in range(_MAX_STEPS):
        along_a, along_b = a @ way, b @ way
        length = float(np.linalg.norm(way))
        if along_b.min() - along_a.max() > distance * length:
            return False
        step = b[along_b.argmin()] - a[along_a.argmax()] - way
        share = -(way @ step) / max(step @ step, 1e-18)
        way = way + min(max(share, 0.0), 1.0) * step
        if np.linalg.norm(way) < distance + _CONTACT:
            return True
    return False


class _Shapes:
    """Corners of a robot's links, and the pairs of links that may meet."""

    def __init__(self, arm: RobotModel) -> None:
        self.mountings = arm.mountings
        self.pairs = tuple(
            (inner.link, outer.link)
            for inner, outer in pairs_that_may_meet(arm.body.hulls, arm.body.exempt_pairs)
        )
        self.corners = {hull.link: np.array(hull.corners) for hull in arm.body.hulls}
        self.joints = {hull.link: hull.joint for hull in arm.body.hulls}
        # Mean of each link's corners in its joint's frame, and their greatest distance from it, m.
        self.middles: dict[str, Triple] = {
            link: tuple(points.mean(axis=0).tolist()) for link, points in self.corners.items()
        }
        self.reaches = {
            link: float(np.linalg.norm(points - points.mean(axis=0), axis=1).max())
            for link, points in self.corners.items()
        }


@cache
def _shapes_of(arm: RobotModel) -> _Shapes:
    return _Shapes(arm)
