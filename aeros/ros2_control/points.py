"""Points of a trajectory, sampled from the decided motion and from the profile that brakes it.

Positions are exact at each point; speeds and accelerations are central differences of them over 0.2 ms. The
controller interpolates between points by polynomials that have these values at both ends.
"""

from __future__ import annotations

from collections.abc import Callable
from math import ceil
from typing import Final

from aeros.ros2_control.controller import TrajectoryPoint
from aeros.wired_arm.arm import Joints
from aeros.wired_arm.streamed_motion import StreamedMotion

_SPACING: Final = 0.02
"""Time between points of a motion, s; chosen."""

_BRAKE_SPACING: Final = 0.01
"""Time between points of a brake profile, s; chosen."""

_MOST_POINTS: Final = 200
"""Greatest number of points, so that a controller reads them in time; those of motions of more than 4 s are
farther apart. As a test computes, interpolation between them is off by less than 1e-6 rad."""

_STEP: Final = 1e-4
"""Half of the time over which differences are taken, s."""


def decided_points(motion: StreamedMotion) -> tuple[TrajectoryPoint, ...]:
    """Sample a whole motion.

    Args:
        motion: the motion.

    Returns:
        Points from its start, at rest, to its end, at rest.
    """
    return _sample(motion.position, 0.0, motion.duration, _SPACING)


def braking_points(motion: StreamedMotion, braked_at: float) -> tuple[TrajectoryPoint, ...]:
    """Sample the profile that brakes a motion on its path.

    Args:
        motion: the motion.
        braked_at: time of the motion at which braking begins, s.

    Returns:
        Points from there to rest; their times count from the start of the motion.
    """

    def position(time: float) -> Joints:
        if time <= braked_at:
            return motion.position(time)
        return motion.braked_position(braked_at, time - braked_at)

    return _sample(position, braked_at, braked_at + motion.braking_time, _BRAKE_SPACING)


def _sample(
    position: Callable[[float], Joints], begin: float, end: float, spacing: float
) -> tuple[TrajectoryPoint, ...]:
    count = max(1, min(_MOST_POINTS, ceil((end - begin) / spacing)))
    points = []
    for number in range(count):
        time = begin + (end - begin) * number / count
        before, here, after = (position(time + shift) for shift in (-_STEP, 0.0, _STEP))
        speeds = tuple([(b - a) / (2.0 * _STEP) for a, b in zip(before, after, strict=True)])
        bends = tuple([(a - 2.0 * b + c) / _STEP**2 for a, b, c in zip(before, here, after, strict=True)])
        points.append(TrajectoryPoint(time, here, speeds, bends))
    last = position(end)
    still = (0.0,) * len(last)
    return (*points, TrajectoryPoint(end, last, still, still))
