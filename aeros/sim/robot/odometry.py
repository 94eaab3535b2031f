"""Wheel odometry: a base that counts its wheels' turns, and drifts from where it is.

With a scale error of each axis, the same in a whole run, and an error of the way that changes along it, as
wheels slip: the share of the way that is not seen is drawn every `_KNOT` metres, and in between it is on the
line from one to the next, so that nothing jumps. Over a way s the drift has a standard deviation of noise·√s.
Source of the form: S. Thrun, W. Burgard, D. Fox, Probabilistic Robotics (2005), section 5.4.
"""

from __future__ import annotations

from math import hypot, sqrt
from typing import Final

from aeros.sim.randomness import RandomSource

_KNOT: Final = 0.1
"""Way between two draws, m."""


class WheelOdometry:
    """Drift of the measured position of a base that drives without turning.

    Args:
        chance: of the errors.
        scale: standard deviation of the scale error of an axis, dimensionless.
        noise: standard deviation of the drift after one metre, m.

    Attributes:
        drift: measured position minus true position, x and y in W, m.
        way: distance driven, m.
    """

    def __init__(self, chance: RandomSource, scale: float = 0.0, noise: float = 0.0) -> None:
        self._chance = chance
        self._scale = tuple((scale * chance.generator("odometry scale").standard_normal(2)).tolist())
        # Of a way of n knots each weighs _KNOT: n·(_KNOT·share)² = noise²·s, with s = n·_KNOT.
        self._share = noise / sqrt(_KNOT)
        self._ends = (self._draw(0), self._draw(1))
        self.drift = (0.0, 0.0)
        self.way = 0.0

    def drive(self, dx: float, dy: float) -> None:
        """Count a small motion.

        Args:
            dx: along x of W, m.
            dy: along y of W, m.
        """
        distance = hypot(dx, dy)
        if distance == 0.0:
            return
        before = int(self.way / _KNOT)
        self.way += distance
        knot = int(self.way / _KNOT)
        if knot != before:
            self._ends = (self._draw(knot), self._draw(knot + 1))
        share = self.way / _KNOT - knot
        (ax, ay), (bx, by) = self._ends
        x, y = self.drift
        self.drift = (
            x + self._scale[0] * dx + distance * (ax + share * (bx - ax)),
            y + self._scale[1] * dy + distance * (ay + share * (by - ay)),
        )

    def _draw(self, knot: int) -> tuple[float, float]:
        x, y = (self._share * self._chance.generator("odometry", knot).standard_normal(2)).tolist()
        return x, y
