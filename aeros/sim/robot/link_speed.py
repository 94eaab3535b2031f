"""Speed of the fastest link, from joint positions and rates and the velocity of the base.

Of each link it follows both ends of its capsule's axis, and of the hand also the tool point. A link is
rigid, so no point of those axes is faster. Not counted: rotation of a link about its own axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin, sqrt
from typing import Final

from aeros.kinematic_chain import Triple, mounting_of
from aeros.sim.robot.body import CAPSULES, PANDA_BODY

_FOLLOWED_POINTS: Final = tuple(
    tuple(
        dict.fromkeys(
            (
                *(end for capsule in CAPSULES if capsule.joint == joint for end in (capsule.a, capsule.b)),
                *((PANDA_BODY.tool_offset,) if joint == len(PANDA_BODY.dh_rows) else ()),
            )
        )
    )
    for joint in range(1, len(PANDA_BODY.dh_rows) + 1)
)

_CHAIN: Final = tuple(
    (*mounting_of(row), points) for row, points in zip(PANDA_BODY.dh_rows, _FOLLOWED_POINTS, strict=True)
)
"""For each joint its `Mounting` and the points that it carries, in its frame, m."""


def max_link_speed(q: Sequence[float], rates: Sequence[float], base: Triple) -> float:
    """Compute the speed in W of the fastest of the followed points.

    Velocities go up the chain in each link's own frame, where its points stay: v = v₋₁ + ω₋₁ × p, ω = ω₋₁ +
    z·q̇, both rotated.

    Args:
        q: joint positions (7), rad.
        rates: joint speeds (7), rad/s.
        base: velocity of the arm's base in W, m/s; the base does not rotate.

    Returns:
        The speed, m/s.
    """
    vx, vy, vz = base
    wx = wy = wz = 0.0
    fastest = vx * vx + vy * vy + vz * vz
    for (x, y, z, ca, sa, points), position, rate in zip(_CHAIN, q, rates, strict=True):
        vx, vy, vz = vx + wy * z - wz * y, vy + wz * x - wx * z, vz + wx * y - wy * x
        vy, vz = ca * vy + sa * vz, ca * vz - sa * vy
        wy, wz = ca * wy + sa * wz, ca * wz - sa * wy
        c, s = cos(position), sin(position)
        vx, vy = c * vx + s * vy, c * vy - s * vx
        wx, wy = c * wx + s * wy, c * wy - s * wx
        wz += rate
        for px, py, pz in points:
            ux, uy, uz = vx + wy * pz - wz * py, vy + wz * px - wx * pz, vz + wx * py - wy * px
            square = ux * ux + uy * uy + uz * uz
            if square > fastest:
                fastest = square
    return sqrt(fastest)
