"""The robot as seen from above: its links, and the carriage that it stands on. Frame: W. Units: m."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache, lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from aeros.kinematic_chain import frames_of
from aeros.sim.geometry import Vector3
from aeros.sim.robot.model import RobotModel
from aeros.sim.robot.robot import CARRIAGE_EDGES
from aeros.sim.scanners.ray_fan import Array

_HALF_EDGES: Final = (CARRIAGE_EDGES[0] / 2.0, CARRIAGE_EDGES[1] / 2.0)


class RobotOutline:
    """Outline of the robot in one posture, of links that are capsules.

    Args:
        arm: the robot.
        joints: joint positions, rad.
        base: position of the arm's base, m.
        carriage: it stands on its carriage.
    """

    def __init__(self, arm: RobotModel, joints: Sequence[float], base: Vector3, *, carriage: bool) -> None:
        self._base = np.array(base)
        self._carriage = carriage
        self._from, self._to = (ends + self._base for ends in _capsule_ends(arm, tuple(joints)))
        self._radii, self._slack, self._may_reach_down = _radii(arm)

    def reaches_down_to(self, height: float) -> bool:
        """Say if a link, other than the foot of the arm that moves, reaches down to a height.

        Args:
            height: in W, m.

        Returns:
            True if one does.
        """
        lowest = np.minimum(self._from[:, 2], self._to[:, 2]) - self._radii
        return bool(lowest[self._may_reach_down].min() < height)

    def covers(self, points: Array, margin: float = 0.0) -> NDArray[np.bool_]:
        """Find points that are within the carriage.

        Args:
            points: (n, 2), m.
            margin: greatest distance of such a point from it, m.

        Returns:
            True for each of them (n,).
        """
        if not self._carriage:
            return np.zeros(len(points), dtype=bool)
        beyond = np.maximum(self._beyond_carriage(points), 0.0)
        inside: NDArray[np.bool_] = np.einsum("nd,nd->n", beyond, beyond) <= margin**2
        return inside

    def covers_with_links(self, points: Array, height: float, margin: float) -> NDArray[np.bool_]:
        """Find points that are within a link.

        Args:
            points: (n, 2), m.
            height: of them in W, m.
            margin: greatest distance of such a point from a link, m.

        Returns:
            True for each of them (n,).
        """
        flat = np.column_stack((points, np.full(len(points), height)))
        within = _from_segments(flat, self._from, self._to) <= self._radii[:, None] + margin
        inside: NDArray[np.bool_] = np.logical_or.reduce(within, axis=0)
        return inside

    def distance(self, points: Array) -> float:
        """Compute the level distance of the nearest point from the robot.

        Args:
            points: (n, 2), m; at least one.

        Returns:
            The distance, m, of the links where they may be nearest; 0 inside it.
        """
        reach = (self._radii + self._slack)[:, None]
        links = _from_segments(points, self._from[:, :2], self._to[:, :2]) - reach
        nearest = float(links.min())
        if self._carriage:
            beyond = np.maximum(self._beyond_carriage(points), 0.0)
            nearest = min(nearest, float(np.hypot(*beyond.T).min()))
        return max(0.0, nearest)

    def offset_of_carriage(self, points: Array) -> Array:
        """Compute how far off the carriage is, from points on its sides.

        Args:
            points: measured points on its sides (n, 2), m.

        Returns:
            Mean displacement of its sides from where they are taken to be, along x and y, m; 0 along an axis
            to whose sides few points belong.
        """
        beyond = self._beyond_carriage(points)
        away = np.sign(points - self._base[:2])
        side = beyond.argmax(axis=1)
        offset = np.zeros(2)
        for axis in (0, 1):
            mine = side == axis
            if mine.sum() >= _LEAST_POINTS:
                offset[axis] = (beyond[mine, axis] * away[mine, axis]).mean()
        return offset

    def _beyond_carriage(self, points: Array) -> Array:
        """Return how far points are outside the carriage's sides along x and y; negative inside."""
        beyond: Array = np.abs(points - self._base[:2]) - _HALF_EDGES
        return beyond


_LEAST_POINTS: Final = 5


def _from_segments(points: Array, a: Array, b: Array) -> Array:
    """Return distances of points (n, d) from segments a to b (m, d) each: (m, n)."""
    along = b - a
    squared = np.maximum((along**2).sum(axis=1), 1e-12)
    # ((p - a)·v) / v², and |p - a - share·v|, one axis after another: arrays with a short last axis are slow.
    share = (along @ points.T - (along * a).sum(axis=1)[:, None]) / squared[:, None]
    share = np.minimum(np.maximum(share, 0.0), 1.0)
    apart = np.zeros(share.shape)
    for axis, of_points in enumerate(points.T):
        apart += (of_points - a[:, axis, None] - share * along[:, axis, None]) ** 2
    distances: Array = np.sqrt(apart)
    return distances


@lru_cache(maxsize=4)
def _capsule_ends(arm: RobotModel, joints: tuple[float, ...]) -> tuple[Array, Array]:
    """Return both ends of the links' capsules (m, 3) each, in the frame of the arm's base."""
    frames = frames_of(arm.mountings, joints)
    ends = [(frames[one.joint].to_base(one.a), frames[one.joint].to_base(one.b)) for one in arm.capsules]
    first, second = zip(*ends, strict=True)
    return np.array(first), np.array(second)


@cache
def _radii(arm: RobotModel) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Return the capsules' radii and slacks, m, and False for the foot of the arm that moves."""
    links, radii, slacks = zip(*[(one.link, one.radius, one.slack) for one in arm.capsules], strict=True)
    return np.array(radii), np.array(slacks), np.array(links) != arm.own_links[0]
