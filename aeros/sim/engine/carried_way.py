"""The way on which a hand carries a body: straight up, over to the goal, and down, turning it meanwhile."""

from __future__ import annotations

from math import cos, sin
from typing import Final

from aeros.sim.geometry import Pose, Quaternion, Vector3, compose

LIFT: Final = 0.25
"""Height above the higher end of the way at which a body is carried, m."""

STIFFNESS: Final = 900.0
"""Acceleration by distance from the way, 1/s²."""

DAMPING: Final = 60.0
"""Acceleration by speed, 1/s: critical for that stiffness."""

MAX_FORCE: Final = 15.0
"""Strength of the hand, N: more than the fingers' friction at their usual grip."""

TURN_GAIN: Final = 0.02
"""Torque by angle of a body of 0.1 kg, N·m/rad: 5 cm of lever, a third of the force that lifts it."""

_UP_UNTIL, _OVER_UNTIL = 0.25, 0.7
"""Shares of the time after which the body is up, and over its goal."""


class CarriedWay:
    """The way of one body.

    Args:
        start: pose of the body's base in W.
        goal: where the middle of its base is to be let go, in W, m.
        turn: angle by which it is turned on the way, rad.
        axis: axis of that turn in W, a unit vector.
        lift: height above the higher end of the way at which it is carried, m.
    """

    def __init__(self, start: Pose, goal: Vector3, turn: float, axis: Vector3, lift: float) -> None:
        self._start = start
        self._goal = goal
        self._turn = turn
        self._axis = axis
        self._high = max(start.position[2], goal[2]) + lift

    def position(self, share: float) -> Vector3:
        """Compute where the body should be.

        Args:
            share: share of the time that has passed, in [0, 1].

        Returns:
            The position of its base in W, m.
        """
        (x, y, z), (u, v, w) = self._start.position, self._goal
        up = _smooth(share / _UP_UNTIL)
        over = _smooth((share - _UP_UNTIL) / (_OVER_UNTIL - _UP_UNTIL))
        down = _smooth((share - _OVER_UNTIL) / (0.95 - _OVER_UNTIL))
        height = z + up * (self._high - z) + down * (w - self._high)
        return (x + over * (u - x), y + over * (v - y), height)

    def orientation(self, share: float) -> Quaternion:
        """Compute how the body should be turned.

        Args:
            share: share of the time that has passed, in [0, 1].

        Returns:
            The orientation of its base in W.
        """
        half = 0.5 * self._turn * _smooth((share - _UP_UNTIL) / (_OVER_UNTIL - _UP_UNTIL))
        a, b, c = self._axis
        turned = Pose((0.0, 0.0, 0.0), (a * sin(half), b * sin(half), c * sin(half), cos(half)))
        return compose(turned, Pose((0.0, 0.0, 0.0), self._start.orientation)).orientation


def _smooth(share: float) -> float:
    """Go from 0 to 1 with no speed at either end."""
    s = min(1.0, max(0.0, share))
    return s * s * (3.0 - 2.0 * s)
