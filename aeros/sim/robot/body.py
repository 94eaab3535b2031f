"""The Panda's links as capsules, as balls that enclose them, and as hulls that enclose them more closely.

Each capsule holds every vertex of the link's collision mesh (franka_ros, as PyBullet ships it), and so the
mesh's convex hull. The capsules were found by random search and are checked by a test. Coordinates are in
the frame of the link's joint.

The hulls, and the pairs of links that need no check, are data: `panda_hulls.json`, written by
`tools/fit_link_hulls.py`.
"""

from __future__ import annotations

import json
from math import ceil, dist, sqrt
from pathlib import Path
from typing import Any, Final, NamedTuple

from aeros.runtime.ports import Ball, Hull, RobotBody, Vec3
from aeros.sim.robot.kinematics import DH_LENGTHS, DH_OFFSETS, DH_TWISTS, FLANGE, TOOL_OFFSET


class Capsule(NamedTuple):
    """All points within `radius` of the segment from `a` to `b`, m.

    Attributes:
        link: name of the link.
        joint: number of joints that move it; 0 for the foot.
        a: one end of the axis, in the frame of that joint, m.
        b: the other end.
        radius: m.
    """

    link: str
    joint: int
    a: Vec3
    b: Vec3
    radius: float


def _hand_point(x: float, y: float, z: float) -> Vec3:
    """Transform a point of the hand to the last joint's frame: the hand is mounted turned by −45°."""
    c = sqrt(0.5)
    return (c * (x + y), c * (y - x), FLANGE + z)


CAPSULES: Final = (
    Capsule("foot", 0, (-0.056, 0.0, 0.020), (-0.005, 0.0, 0.052), 0.107),
    Capsule("link1", 1, (0.0, -0.054, 0.002), (0.0, 0.0, -0.140), 0.077),
    Capsule("link2", 2, (0.0, -0.142, 0.0), (0.0, 0.002, 0.054), 0.077),
    Capsule("link3", 3, (0.083, 0.043, 0.0), (0.001, 0.0, -0.080), 0.0705),
    Capsule("link4", 4, (0.0, 0.0, 0.042), (-0.082, 0.082, 0.0), 0.0705),
    Capsule("link5", 5, (0.0, 0.064, 0.002), (0.0, 0.010, -0.241), 0.0685),
    Capsule("link6", 6, (0.087, 0.008, 0.0), (0.021, 0.012, 0.005), 0.0755),
    Capsule("link7", 7, (-0.005, -0.005, 0.073), (0.033, 0.033, 0.080), 0.050),
    Capsule("hand", 7, _hand_point(0.0, -0.079, 0.021), _hand_point(0.0, 0.062, 0.031), 0.050),
    # Both fingers at any gap: 66 mm to each side, from 58 to 113 mm beyond the flange.
    Capsule("fingers", 7, _hand_point(0.0, -0.042, 0.086), _hand_point(0.0, 0.042, 0.086), 0.039),
)


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


def _read_hulls() -> dict[str, Any]:
    data = json.loads(Path(__file__).with_name("panda_hulls.json").read_text(encoding="utf-8"))
    hulls = [
        Hull(one["link"], one["joint"], tuple(tuple(corner) for corner in one["corners"]), one["radius"])
        for one in data["hulls"]
    ]
    return {"hulls": tuple(hulls), "exempt_pairs": tuple(tuple(one["links"]) for one in data["exempt_pairs"])}


PANDA_BODY: Final = RobotBody(
    dh_rows=tuple(zip(DH_LENGTHS, DH_TWISTS, DH_OFFSETS, strict=True)),
    tool_offset=(0.0, 0.0, TOOL_OFFSET),
    balls=tuple(ball for capsule in CAPSULES for ball in enclosing_balls(capsule)),
    **_read_hulls(),
)
