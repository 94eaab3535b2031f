"""Links of a robot as capsules, and balls that enclose these.

A capsule holds every vertex of its link's collision mesh, and so the mesh's convex hull; a test checks this
of the robots that come with AEROS. Coordinates are in the frame of the link's joint.
"""

from __future__ import annotations

from math import ceil, dist, sqrt
from typing import NamedTuple

from aeros.runtime.ports import Ball, Vec3


class Capsule(NamedTuple):
    """All points within `radius` of the segment from `a` to `b`, m.

    Attributes:
        link: name of the link.
        joint: number of joints that move it; 0 for the foot.
        a: one end of the axis, in the frame of that joint, m.
        b: the other end.
        radius: m.
        slack: farther that the link may be from there, m; 0 of links whose joints are measured.
    """

    link: str
    joint: int
    a: Vec3
    b: Vec3
    radius: float
    slack: float = 0.0


def enclosing_balls(capsule: Capsule) -> tuple[Ball, ...]:
    """Cover a capsule with balls: centres on its segment, both ends among them, ℓ ≤ r/2 apart.

    The stretch of ℓ around a centre lies within √(r² + (ℓ/2)²) of it, and each end in that end's ball.

    Args:
        capsule: in the frame of its joint, m.

    Returns:
        Balls of equal radius in the same frame; together they contain the capsule.
    """
    length, r = dist(capsule.a, capsule.b), capsule.radius
    gaps = max(1, ceil(length / (r / 2.0)))
    radius = sqrt(r * r + (length / gaps / 2.0) ** 2)
    shares = [number / gaps for number in range(gaps + 1)]
    (ax, ay, az), (bx, by, bz) = capsule.a, capsule.b
    return tuple(
        Ball(
            capsule.link,
            capsule.joint,
            (ax + share * (bx - ax), ay + share * (by - ay), az + share * (bz - az)),
            radius,
        )
        for share in shares
    )
