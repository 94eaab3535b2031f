"""Minimum-jerk joint profiles along straight tool paths, slowed until every limit holds.

s(t) = 10u³ − 15u⁴ + 6u⁵ with u = t/T: rests at both ends, peak speed 1.875 × mean.  The path is
solved at waypoints and joined by cubic Hermite pieces; the profile that is checked is the one that
is streamed, tick by tick.
Units: SI.  Frames: as in `kinematics` (B, the arm's base).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil
from typing import Final

import numpy as np

from aeros.sim.kinematics import solve, solve_one
from aeros.sim.limits import QD_MAX, QDD_MAX, TOOL_SPEED_MAX, YAW_SPEED_MAX, Vector

TICK: Final = 1.0 / 240.0
"""Control and simulation period, s."""

PEAK_TO_MEAN: Final = 1.875
"""Peak over mean speed of the minimum-jerk profile."""

_SHARE: Final = 0.5
"""Share of the joint speed and acceleration limits a profile may use: tracking and stopping need the rest."""

_SPACING: Final = 0.01
"""Distance between solved waypoints, m (and 0.05 rad of yaw): chords stay within 0.01 mm of the line."""

_LARGEST_JUMP: Final = 0.25
"""Joint change between waypoints above which two solutions lie on different branches, rad."""


class UnreachableError(Exception):
    """No motion inside the limits does what was asked; the message says why."""


@dataclass(frozen=True, slots=True)
class JointProfile:
    """Set points per tick, the first one tick after the start.

    q, qd: (n, 7), rad and rad/s.
    """

    q: Vector
    qd: Vector


def minimum_jerk(u: Vector) -> tuple[Vector, Vector, Vector]:
    """s, ds/du and d²s/du² of the minimum-jerk profile at u in [0, 1]."""
    s = u**3 * (10.0 - 15.0 * u + 6.0 * u * u)
    ds = 30.0 * u**2 * (1.0 - u) ** 2
    dds = 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u)
    return s, ds, dds


def minimum_jerk_ticks(distance: float, peak_speed: float) -> int:
    """Ticks of a minimum-jerk move over `distance` (m) that peaks at or below `peak_speed` (m/s)."""
    return max(1, ceil(PEAK_TO_MEAN * distance / peak_speed / TICK))


def straight_profile(
    q_start: Vector, start: tuple[Vector, float], end: tuple[Vector, float], peak_speed: float
) -> JointProfile:
    """The profile from `q_start`, at pose `start`, along the straight line to pose `end`.

    Poses are (p_BT in m, yaw in rad), the tool pointing down.  `peak_speed` bounds the tool's speed,
    m/s; joint limits may make it slower.  Raises `UnreachableError`.
    """
    (p_start, yaw_start), (p_end, yaw_end) = start, end
    distance = float(np.linalg.norm(p_end - p_start))
    turn = abs(yaw_end - yaw_start)
    pieces = max(2, ceil(max(distance / _SPACING, turn / 0.05)))
    path = _joint_path(q_start, start, end, pieces)
    tangent = _tangents(path)
    ticks = max(
        minimum_jerk_ticks(distance, min(peak_speed, TOOL_SPEED_MAX)),
        minimum_jerk_ticks(turn, YAW_SPEED_MAX * _SHARE),
        24,
    )
    for _ in range(12):
        q, qd, qdd = _sample(path, tangent, ticks)
        excess = max(
            float((np.abs(qd) / (QD_MAX * _SHARE)).max()),
            float(np.sqrt((np.abs(qdd) / (QDD_MAX * _SHARE)).max())),
        )
        if excess <= 1.0:
            return JointProfile(q, qd)
        ticks = ceil(ticks * excess * 1.01)
    raise UnreachableError("no duration brings the joint speeds inside the limits")


def _joint_path(
    q_start: Vector, start: tuple[Vector, float], end: tuple[Vector, float], pieces: int
) -> Vector:
    """Joint waypoints (pieces + 1, 7) on the line, the first exactly `q_start`."""
    (p_start, yaw_start), (p_end, yaw_end) = start, end
    q_end = solve_one(p_end, yaw_end, q_start)
    if q_end is None:
        raise UnreachableError(
            f"no joint position puts the tool at {_spell(p_end)} with yaw {yaw_end:.3f} rad"
        )
    share = np.linspace(0.0, 1.0, pieces + 1)
    guess = q_start + share[:, None] * (q_end - q_start)
    line = p_start + share[:, None] * (p_end - p_start)
    path = solve(line, yaw_start + share * (yaw_end - yaw_start), guess)
    if path is None:
        raise UnreachableError(f"the straight line to {_spell(p_end)} leaves the arm's reach")
    # The start may be off the solver's posture (after a stop); let the difference fade out.
    fade = 1.0 - minimum_jerk(share)[0]
    joined: Vector = path + fade[:, None] * (q_start - path[0])
    if float(np.abs(np.diff(joined, axis=0)).max()) > _LARGEST_JUMP:
        raise UnreachableError(f"the straight line to {_spell(p_end)} needs a change of posture")
    return joined


def _tangents(path: Vector) -> Vector:
    """dq/ds at the waypoints, s in [0, 1]: central differences, second order at the ends."""
    tangent: Vector = np.gradient(path, 1.0 / (len(path) - 1), axis=0, edge_order=2)
    return tangent


def _sample(path: Vector, tangent: Vector, ticks: int) -> tuple[Vector, Vector, Vector]:
    """Positions, speeds and accelerations (ticks, 7) of the Hermite path under minimum-jerk timing."""
    duration = ticks * TICK
    s, ds, dds = minimum_jerk(np.arange(1, ticks + 1) / ticks)
    pieces = len(path) - 1
    index = np.minimum((s * pieces).astype(int), pieces - 1)
    u = (s * pieces - index)[:, None]
    a, b = path[index], path[index + 1]
    ta, tb = tangent[index] / pieces, tangent[index + 1] / pieces
    q = (2 * u**3 - 3 * u**2 + 1) * a + (u**3 - 2 * u**2 + u) * ta
    q += (3 * u**2 - 2 * u**3) * b + (u**3 - u**2) * tb
    dq = ((6 * u**2 - 6 * u) * (a - b) + (3 * u**2 - 4 * u + 1) * ta + (3 * u**2 - 2 * u) * tb) * pieces
    ddq = (12 * u - 6) * (a - b) + (6 * u - 4) * ta + (6 * u - 2) * tb
    ddq *= pieces * pieces
    rate, bend = (ds / duration)[:, None], (dds / duration**2)[:, None]
    return q, dq * rate, ddq * rate**2 + dq * bend


def _spell(p: Vector) -> str:
    return f"({p[0]:.3f}, {p[1]:.3f}, {p[2]:.3f}) m"
