"""Minimum-jerk joint profiles along straight tool paths, slowed down until every limit holds.

s(t) = 10u³ − 15u⁴ + 6u⁵ with u = t/T: at rest at both ends, peak speed 1.875 × mean. The path is solved at
waypoints and joined by a cubic spline, whose second derivative has no jumps, so jerk is bounded. The
profile that is decided is the one that is executed, tick by tick.
Units: SI. Frames: as in `kinematics` (B, the arm's base).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, cos, sqrt
from typing import Final

import numpy as np

from aeros.runtime.ports import JointPath
from aeros.sim.clock import TICK
from aeros.sim.robot.kinematics import forward_kinematics, solve_ik, solve_ik_one
from aeros.sim.robot.limits import Vector
from aeros.sim.robot.model import RobotModel

PEAK_TO_MEAN: Final = 1.875
"""Peak over mean speed of the minimum-jerk profile."""

ACCELERATION_TO_MEAN: Final = 5.7736
"""Peak acceleration of the minimum-jerk profile over distance per squared duration: 10/√3, at u = 0.211."""

JERK_TO_MEAN: Final = 60.0
"""Peak jerk of it over distance per cubed duration, at both ends."""

_LIMIT_SHARE: Final = 0.5
"""Share of the joint speed and acceleration limits a profile may use: tracking and stopping need the rest."""

_WAYPOINT_SPACING: Final = 0.01
"""Distance between solved waypoints, m (and 0.05 rad of yaw): chords stay within 0.01 mm of the line."""

_MAX_JOINT_STEP: Final = 0.25
"""Joint change between waypoints above which two solutions lie on different branches, rad."""


class UnreachableError(Exception):
    """No motion inside the limits does what was asked; the message says why."""


_SPEED_MARGIN: Final = 0.99
"""Share of the requested speed that a profile peaks at: the spline is as fast as the line to 0.1 %, and the
bound that the decision uses takes as much."""


_MAX_TILT: Final = 1e-3
"""Tilt of the tool above which the start of a profile is off its line, rad."""

_OFF_LINE_SPEED_SHARE: Final = 0.9
"""Share of a speed limit that a tool may use while it is off its line, as sampled."""

_OFF_LINE_ACCELERATION_SHARE: Final = 0.1
"""Share of an acceleration limit likewise: on a bent path the decision's bound is up to eight times the
sampled value."""

_MIN_OFF_LINE_PIECES: Final = 30
"""Least number of pieces of such a path: with few long pieces the decision's bounds are wide."""

_MIN_TICKS: Final = 24
"""Least number of ticks of a profile (0.1 s), however short its path."""

_SAMPLES_PER_PIECE: Final = 8
"""Samples of each piece of a path that is off its line."""


@dataclass(frozen=True, slots=True)
class JointProfile:
    """A joint path and its duration in ticks.

    Attributes:
        path: the joint path, rad.
        ticks: duration in ticks.
    """

    path: JointPath
    ticks: int

    def sample(self) -> tuple[Vector, Vector]:
        """Compute the set points of every tick; the first is one tick after the start.

        Returns:
            Joint positions, rad, and speeds, rad/s, each of shape (ticks, joints).
        """
        q, qd, _ = _sample(np.array(self.path), self.ticks)
        return q, qd


def minimum_jerk(u: Vector) -> tuple[Vector, Vector, Vector]:
    """Compute the minimum-jerk profile s(u) = 10u³ − 15u⁴ + 6u⁵ and its derivatives.

    Args:
        u: shares of the duration, in [0, 1].

    Returns:
        s, ds/du and d²s/du², in the shape of `u`.
    """
    s = u**3 * (10.0 - 15.0 * u + 6.0 * u * u)
    ds = 30.0 * u**2 * (1.0 - u) ** 2
    dds = 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u)
    return s, ds, dds


def minimum_jerk_ticks(distance: float, peak_speed: float) -> int:
    """Compute the duration of a minimum-jerk move.

    Args:
        distance: m (or rad).
        peak_speed: speed that it must not exceed, m/s (or rad/s).

    Returns:
        Ticks, at least 1.
    """
    return max(1, ceil(PEAK_TO_MEAN * distance / peak_speed / TICK))


def line_profile(
    arm: RobotModel,
    q_start: Vector,
    start: tuple[Vector, float],
    end: tuple[Vector, float],
    peak_speed: float,
) -> JointProfile:
    """Plan a profile along a straight line of the tool.

    Poses are (p_BT in m, yaw in rad), the tool pointing down.

    Args:
        arm: the robot.
        q_start: joint positions at the start, rad.
        start: the tool's pose there, in B.
        end: its pose at the end, in B.
        peak_speed: bound on the tool's speed, m/s; joint limits may make it slower.

    Returns:
        The profile; it begins exactly at `q_start`.

    Raises:
        UnreachableError: the line leaves the arm's reach, or needs another arm configuration.
    """
    distance, turn, pieces = _line_geometry(start, end)
    is_tilted = _is_tilted(arm, q_start)
    if is_tilted:
        pieces = max(pieces, _MIN_OFF_LINE_PIECES)
    path = _spline(_joint_path(arm, q_start, start, end, pieces))
    ticks = max(
        minimum_jerk_ticks(distance, min(peak_speed, arm.tool_limits.speed) * _SPEED_MARGIN),
        minimum_jerk_ticks(turn, arm.tool_limits.turning_speed * _LIMIT_SHARE),
        _MIN_TICKS,
    )
    if is_tilted:
        ticks = max(ticks, _off_line_ticks(arm, path, min(peak_speed, arm.tool_limits.speed)))
    return _within_limits(arm, path, ticks)


def joint_profile(arm: RobotModel, q_start: Vector, q_end: Vector, peak_speed: float) -> JointProfile:
    """Plan a profile along a straight line in joint space.

    Args:
        arm: the robot.
        q_start: joint positions at the start, rad.
        q_end: joint positions at the end, rad.
        peak_speed: bound on the tool's speed, m/s; limits may make it slower.

    Returns:
        The profile.

    Raises:
        UnreachableError: no duration keeps the joints inside their limits.
    """
    share = np.linspace(0.0, 1.0, _MIN_OFF_LINE_PIECES + 1)
    path = _spline(q_start + share[:, None] * (q_end - q_start))
    ticks = max(_off_line_ticks(arm, path, min(peak_speed, arm.tool_limits.speed)), _MIN_TICKS)
    return _within_limits(arm, path, ticks)


def _within_limits(arm: RobotModel, path: Vector, ticks: int) -> JointProfile:
    """Return the path with so many ticks, or as many more as keep every joint inside its limits.

    Raises:
        UnreachableError: no duration is long enough.
    """
    for _ in range(12):
        _, qd, qdd = _sample(path, ticks)
        excess = max(
            float((np.abs(qd) / (arm.limits.speed * _LIMIT_SHARE)).max()),
            float(np.sqrt((np.abs(qdd) / (arm.limits.acceleration * _LIMIT_SHARE)).max())),
        )
        if excess <= 1.0:
            return JointProfile(to_port_path(path), ticks)
        ticks = ceil(ticks * excess * 1.01)
    raise UnreachableError("no duration brings the joint speeds inside the limits")


def line_path(
    arm: RobotModel, q_guess: Vector, start: tuple[Vector, float], end: tuple[Vector, float]
) -> JointPath:
    """Plan the joint path of a straight line of the tool, without timing.

    Args:
        arm: the robot.
        q_guess: joint positions near which the solution of the start is sought, rad.
        start: pose at the start: (p_BT in m, yaw in rad).
        end: pose at the end, likewise.

    Returns:
        The path.

    Raises:
        UnreachableError: the line leaves the arm's reach, or needs another arm configuration.
    """
    q_start = solve_ik_one(arm, *start, q_guess)
    if q_start is None:
        raise UnreachableError(f"no joint position puts the tool at {_format_point(start[0])}")
    _, _, pieces = _line_geometry(start, end)
    return to_port_path(_spline(_joint_path(arm, q_start, start, end, pieces)))


def _line_geometry(start: tuple[Vector, float], end: tuple[Vector, float]) -> tuple[float, float, int]:
    """Return distance (m), turn (rad) and the number of path pieces between two poses."""
    distance = float(np.linalg.norm(end[0] - start[0]))
    turn = abs(end[1] - start[1])
    return distance, turn, max(2, ceil(max(distance / _WAYPOINT_SPACING, turn / 0.05)))


def _joint_path(
    arm: RobotModel, q_start: Vector, start: tuple[Vector, float], end: tuple[Vector, float], pieces: int
) -> Vector:
    """Solve joint waypoints (pieces + 1, joints) on the line, the first exactly `q_start`.

    Raises:
        UnreachableError: the target or the line to it is out of reach.
    """
    (p_start, yaw_start), (p_end, yaw_end) = start, end
    q_end = solve_ik_one(arm, p_end, yaw_end, q_start)
    if q_end is None:
        raise UnreachableError(
            f"no joint position puts the tool at {_format_point(p_end)} with yaw {yaw_end:.3f} rad"
        )
    share = np.linspace(0.0, 1.0, pieces + 1)
    guess = q_start + share[:, None] * (q_end - q_start)
    line = p_start + share[:, None] * (p_end - p_start)
    path = solve_ik(arm, line, yaw_start + share * (yaw_end - yaw_start), guess)
    if path is None:
        raise UnreachableError(f"the straight line to {_format_point(p_end)} leaves the arm's reach")
    # The start may be off the solver's posture (after a stop); fade out the difference.
    fade = 1.0 - minimum_jerk(share)[0]
    joined: Vector = path + fade[:, None] * (q_start - path[0])
    if float(np.abs(np.diff(joined, axis=0)).max()) > _MAX_JOINT_STEP:
        raise UnreachableError(f"the straight line to {_format_point(p_end)} needs an arm reconfiguration")
    return joined


def _is_tilted(arm: RobotModel, q: Vector) -> bool:
    """Return True if the tool does not point down."""
    _, turned, _ = forward_kinematics(arm, q[None, :])
    return float(-turned[0, 2, 2]) < cos(_MAX_TILT)


def _off_line_ticks(arm: RobotModel, path: Vector, peak_speed: float) -> int:
    """Return ticks that keep the tool inside its limits wherever on the path timing is fastest."""
    step = 1.0 / _SAMPLES_PER_PIECE
    u = np.arange(0.0, 1.0, step)[:, None]
    v = 1.0 - u
    a, b, c, d = (path[:, None, corner] for corner in range(4))
    q = (v**3 * a + 3.0 * v * u * (v * b + u * c) + u**3 * d).reshape(-1, path.shape[2])
    places, turned, _ = forward_kinematics(arm, np.vstack((q, path[-1, 3])))
    turns = np.swapaxes(turned[:-1], 1, 2) @ turned[1:]
    # Of small turns the skew-symmetric part is the axis times the angle.
    turning = [turns[:, i, j] - turns[:, j, i] for i, j in ((2, 1), (0, 2), (1, 0))]
    step /= len(path)
    return max(
        _ticks_for_limits(np.diff(places, axis=0) / step, step, peak_speed, arm.tool_limits.acceleration),
        _ticks_for_limits(
            np.stack(turning, axis=1) / 2.0 / step,
            step,
            arm.tool_limits.turning_speed,
            arm.tool_limits.turning_acceleration,
        ),
    )


def _ticks_for_limits(first: Vector, step: float, speed: float, acceleration: float) -> int:
    """Bound the duration by ẋ = x'·ṡ and ẍ = x''·ṡ² + x'·s̈, each factor at its maximum.

    `first` holds the derivatives by s, `step` apart.
    """
    most = float(np.linalg.norm(first, axis=1).max())
    second = float(np.linalg.norm(np.diff(first, axis=0) / step, axis=1).max())
    bend = second * PEAK_TO_MEAN**2 + most * ACCELERATION_TO_MEAN
    duration = max(
        PEAK_TO_MEAN * most / (speed * _OFF_LINE_SPEED_SHARE),
        sqrt(bend / (acceleration * _OFF_LINE_ACCELERATION_SHARE)),
    )
    return ceil(duration / TICK)


def _spline(points: Vector) -> Vector:
    """Compute Bézier control points (pieces, 4, joints) of the cubic spline through `points`.

    Its end slopes are second-order differences; inside, slopes m solve m₋ + 4m + m₊ = 3(q₊ − q₋).
    """
    n = len(points) - 1
    slopes: Vector = np.gradient(points, axis=0, edge_order=2)
    if n > 1:
        matrix = 4.0 * np.eye(n - 1) + np.eye(n - 1, k=1) + np.eye(n - 1, k=-1)
        right = 3.0 * (points[2:] - points[:-2])
        right[0] -= slopes[0]
        right[-1] -= slopes[-1]
        slopes[1:-1] = np.linalg.solve(matrix, right)
    a, b = points[:-1], points[1:]
    return np.stack((a, a + slopes[:-1] / 3.0, b - slopes[1:] / 3.0, b), axis=1)


def to_port_path(pieces: Vector) -> JointPath:
    """Convert control points to the form of `aeros.runtime.ports`.

    Args:
        pieces: Bézier control points (pieces, 4, joints), rad.

    Returns:
        The same numbers as nested tuples.
    """
    return tuple((tuple(a), tuple(b), tuple(c), tuple(d)) for a, b, c, d in pieces.tolist())


def _sample(pieces: Vector, ticks: int) -> tuple[Vector, Vector, Vector]:
    """Sample positions, speeds and accelerations (ticks, joints) of the spline under minimum-jerk timing."""
    duration, n = ticks * TICK, len(pieces)
    s, ds, dds = minimum_jerk(np.arange(1, ticks + 1) / ticks)
    index = np.minimum((s * n).astype(int), n - 1)
    u = (s * n - index)[:, None]
    v = 1.0 - u
    a, b, c, d = (pieces[index, corner] for corner in range(4))
    q = v**3 * a + 3.0 * v * u * (v * b + u * c) + u**3 * d
    dq = 3.0 * n * (v * v * (b - a) + 2.0 * v * u * (c - b) + u * u * (d - c))
    ddq = 6.0 * n * n * (v * (c - 2.0 * b + a) + u * (d - 2.0 * c + b))
    rate, bend = (ds / duration)[:, None], (dds / duration**2)[:, None]
    return q, dq * rate, ddq * rate**2 + dq * bend


def _format_point(p: Vector) -> str:
    return f"({p[0]:.3f}, {p[1]:.3f}, {p[2]:.3f}) m"
