"""The decided motion as a stream of set points, and the profile that brakes it.

The decided motion is q(s(τ/T)) with s(u) = 10u³ − 15u⁴ + 6u⁵ and a path q of Bézier pieces. Normally τ goes
with the robot's clock. To brake, the clock of the motion slows down to a standstill: τ' goes from 1 to 0
evenly, with short ramps at both ends. So a braking arm stays on the path that was decided, and each joint has

    q'' = q_ττ·τ'² + q_τ·τ'',   |q''| ≤ A + V·b

with the greatest acceleration A and speed V of the decided motion, and the rate b of braking (1/s). It is the
greatest with A + V·b ≤ 0.9·limit. The ramps take as long as keeps V·b over their length below half of the
jerk limit.

This module is pure Python: it runs in the process that has a millisecond for each cycle.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Final

from aeros.wired_arm.arm import CYCLE, Joints

PathPiece = tuple[Joints, Joints, Joints, Joints]

_STOP_SHARE: Final = 0.9
"""Share of the acceleration limits that braking uses."""

_LEAST_SHARE: Final = 0.2
"""Share of them that braking has at least, whatever the motion needs; decided motions need half at most."""

_JERK_SHARE: Final = 0.5
"""Share of the jerk limits that the ramps of braking use."""

_SHORTEST_RAMP: Final = 0.004
"""Shortest ramp of braking, s: four cycles."""

_FASTEST_BRAKE: Final = 40.0
"""Greatest rate of braking, 1/s: slow motions stop in 25 ms."""

_FADE_TIME: Final = 0.2
"""Time of a motion in which the distance from its start to where the arm is commanded fades out, s."""

_PEAK_SPEED: Final = 1.875
_PEAK_ACCELERATION: Final = 5.7736
"""Greatest speed and acceleration of s(u), for a unit of distance in a unit of time."""

_SAMPLES: Final = 200
_SAMPLE_MARGIN: Final = 1.05
"""Samples of the motion in which its peaks are sought, and the factor on these."""


class BrakeClock:
    """Clock of a motion that slows down from its full rate to a standstill.

    Args:
        rate: of braking, 1/s.
        ramp: time in which braking comes on, and goes off, s.
    """

    def __init__(self, rate: float, ramp: float) -> None:
        self._ramp = ramp
        self._rate = min(rate, 1.0 / ramp)
        self._even = 1.0 / self._rate - ramp

    @property
    def duration(self) -> float:
        """Time until the standstill, s."""
        return self._even + 2.0 * self._ramp

    def way(self, time: float) -> float:
        """Compute how far the clock of the motion goes while it brakes.

        Args:
            time: since braking began, s.

        Returns:
            Seconds of the motion's own time.
        """
        b, ramp, even = self._rate, self._ramp, self._even
        on = min(time, ramp)
        way = on - b * on**3 / (6.0 * ramp)
        if time <= ramp:
            return way
        left = 1.0 - b * ramp / 2.0
        level = min(time - ramp, even)
        way += left * level - b * level * level / 2.0
        if time <= ramp + even:
            return way
        left -= b * even
        off = min(time - ramp - even, ramp)
        return way + left * off - b * off * off / 2.0 + b * off**3 / (6.0 * ramp)


class StreamedMotion:
    """Set points of one motion, cycle by cycle.

    Args:
        path: Bézier pieces of equal length in s, rad.
        duration: T, s.
        acceleration: limit of each joint, rad/s².
        jerk: limit of each joint, rad/s³.
    """

    def __init__(
        self, path: Sequence[PathPiece], duration: float, acceleration: Sequence[float], jerk: Sequence[float]
    ) -> None:
        self._path, self._duration = path, duration
        self._limits = acceleration, jerk
        self._fade = min(_FADE_TIME, duration)
        self._offset: Joints = (0.0,) * len(acceleration)
        self._peaks = _peaks(self)
        self._clock = _brake_clock(*self._peaks, *self._limits)
        self._time = 0.0
        self._braked_at: float | None = None

    @property
    def start(self) -> Joints:
        """Position at which the motion begins, rad."""
        return self._path[0][0]

    @property
    def duration(self) -> float:
        """Duration of the whole motion, s."""
        return self._duration

    @property
    def is_braking(self) -> bool:
        """True from `brake` on."""
        return self._braked_at is not None

    @property
    def braking_time(self) -> float:
        """Time that braking takes, s."""
        return self._clock.duration

    def begin_at(self, commanded: Joints) -> None:
        """Begin where the arm is commanded; the distance from there to the motion's start fades out.

        Args:
            commanded: positions, rad.
        """
        self._offset = tuple(a - b for a, b in zip(commanded, self.start, strict=True))
        speeds, accelerations = self._peaks
        faster = [v + _PEAK_SPEED * abs(d) / self._fade for v, d in zip(speeds, self._offset, strict=True)]
        harder = [
            a + _PEAK_ACCELERATION * abs(d) / self._fade**2
            for a, d in zip(accelerations, self._offset, strict=True)
        ]
        self._clock = _brake_clock(faster, harder, *self._limits)

    def brake(self) -> None:
        """Begin to brake at the next cycle; nothing changes if it brakes already."""
        if self._braked_at is None:
            self._braked_at = self._time

    def step(self, elapsed: float) -> tuple[Joints, bool]:
        """Compute the set point of the next cycle.

        Args:
            elapsed: time on the robot's clock since the last one, s: a cycle, or several if some were lost.

        Returns:
            Positions, rad, and True if the arm rests there.
        """
        self._time += elapsed
        if self._braked_at is None:
            return self.position(self._time), self._time >= self._duration
        since = self._time - self._braked_at
        own = self._braked_at + self._clock.way(since)
        return self.position(own), since >= self._clock.duration or own >= self._duration

    def braked_position(self, braked_at: float, since: float) -> Joints:
        """Compute a point of the motion as it is braked.

        Args:
            braked_at: τ at which braking begins, s.
            since: time since then, s.

        Returns:
            Positions, rad.
        """
        return self.position(braked_at + self._clock.way(since))

    def position(self, time: float) -> Joints:
        """Compute a point of the motion.

        Args:
            time: τ, s.

        Returns:
            Positions, rad.
        """
        u = min(1.0, max(0.0, time / self._duration))
        s = _minimum_jerk(u) * len(self._path)
        number = min(int(s), len(self._path) - 1)
        w = s - number
        v = 1.0 - w
        a, b, c, d = v * v * v, 3.0 * v * v * w, 3.0 * v * w * w, w * w * w
        left = 1.0 - _minimum_jerk(min(1.0, max(0.0, time / self._fade)))
        return tuple(
            [
                a * p + b * q + c * r + d * t + left * offset
                for p, q, r, t, offset in zip(*self._path[number], self._offset, strict=True)
            ]
        )


def _minimum_jerk(u: float) -> float:
    return u * u * u * (10.0 - 15.0 * u + 6.0 * u * u)


def _peaks(motion: StreamedMotion) -> tuple[list[float], list[float]]:
    """Return the greatest speed, rad/s, and acceleration, rad/s², of each joint, as sampled."""
    count = max(4, min(_SAMPLES, round(motion.duration / CYCLE)))
    step = motion.duration / count
    points = [motion.position(number * step) for number in range(count + 1)]
    columns = [*zip(*points, strict=True)]
    speeds = [max(abs(b - a) for a, b in pairwise(one)) / step for one in columns]
    bends = [
        max(abs(a - 2.0 * b + c) for a, b, c in zip(one, one[1:], one[2:], strict=False)) / step**2
        for one in columns
    ]
    return [_SAMPLE_MARGIN * one for one in speeds], [_SAMPLE_MARGIN * one for one in bends]


def _brake_clock(
    speeds: Sequence[float],
    accelerations: Sequence[float],
    acceleration_limits: Sequence[float],
    jerk_limits: Sequence[float],
) -> BrakeClock:
    """Return the hardest braking that keeps every joint inside its limits."""
    rate = _FASTEST_BRAKE
    for speed, needed, limit in zip(speeds, accelerations, acceleration_limits, strict=True):
        if speed > 0.0:
            rate = min(rate, max(_STOP_SHARE * limit - needed, _LEAST_SHARE * limit) / speed)
    ramp = max(
        _SHORTEST_RAMP,
        *(speed * rate / (_JERK_SHARE * limit) for speed, limit in zip(speeds, jerk_limits, strict=True)),
    )
    return BrakeClock(rate, ramp)
