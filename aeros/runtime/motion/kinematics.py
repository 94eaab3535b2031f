"""Bounds on the displacement of a robot's point while the joints stay in a box of positions.

Frames: B is the robot's base. The bound of `ForwardKinematics.displacement_bound`: let joint i be anywhere
within w_i of the joint position q. Changing one joint after the other moves a point p by at most w_i·ρ_i
each, where ρ_i bounds p's distance from axis i: rotation by φ at distance ρ moves by 2ρ·sin(φ/2) ≤ ρφ. That
distance depends only on the joints beyond i, so ρ_i = (distance at q) + Σ_{j>i} w_j·ρ_j, from the tip
inwards.
Every partial derivative of p by joints, of any order, is at most ρ_k long, k the outermost of them: the
innermost derivative is a vector of the length of p's distance from axis k, or less, and each further one
turns it, which lengthens nothing.

The bound of `ForwardKinematics.chord_deviation_bound`: let the joints be at q + λd + ε, λ in [−1, 1] and
|ε_i| ≤ r_i. By Taylor, p is within ½ΣΣρ_max(i,j)·w_i·w_j, w_i = |d_i| + r_i, of the point that its first
derivatives J give, which is λ·Jd + Jε from its place at q, and |Jε| ≤ Σ|J_i|·r_i. In Jd, unlike in sums of
magnitudes, opposite effects of joints cancel.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, sqrt

from aeros.kinematic_chain import frames_of, mounting_of
from aeros.runtime.ports import RobotBody, Vec3


class ForwardKinematics:
    """Forward kinematics at one joint position `q` (rad).

    frames: `frames[k]` is the frame of joint k in B, `frames[0]` the base's; m.
    """

    def __init__(self, body: RobotBody, q: Sequence[float]) -> None:
        self.frames = frames_of(map(mounting_of, body.dh_rows), q)

    def displacement_bound(self, joint: int, p: Vec3, width: Sequence[float]) -> tuple[float, list[float]]:
        """Bound the displacement of a point while each joint stays near its position.

        Args:
            joint: number of joints that move the point.
            p: the point in B, m.
            width: greatest deviation of each joint, rad.

        Returns:
            The bound, m, and ρ of each joint that moves the point, m.
        """
        total, reaches = 0.0, [0.0] * joint
        x, y, z = p
        for k in range(joint - 1, -1, -1):
            origin, _, _, (ax, ay, az) = self.frames[k + 1]
            dx, dy, dz = x - origin[0], y - origin[1], z - origin[2]
            off = hypot(ay * dz - az * dy, az * dx - ax * dz, ax * dy - ay * dx)
            reaches[k] = off + total
            total += width[k] * reaches[k]
        return total, reaches

    def chord_deviation_bound(self, joint: int, p: Vec3, along: ChordTerms) -> tuple[Vec3, float]:
        """Bound the displacement of a point while the joints stay near a chord.

        Args:
            joint: number of joints that move the point.
            p: the point in B at the middle of the chord, m.
            along: the chord's terms, from `chord_terms`.

        Returns:
            Half edges |Jd| of a box around `p`, m, and the greatest distance of the point from that box, m.
        """
        x, y, z = p
        jx = jy = jz = total = near = 0.0
        for k in range(joint - 1, -1, -1):
            (ox, oy, oz), _, _, (ax, ay, az) = self.frames[k + 1]
            d, r, w, pairs = along[k]
            dx, dy, dz = x - ox, y - oy, z - oz
            cx, cy, cz = ay * dz - az * dy, az * dx - ax * dz, ax * dy - ay * dx
            off = hypot(cx, cy, cz)
            reach = off + total
            total += w * reach
            near += off * r + reach * pairs
            jx += cx * d
            jy += cy * d
            jz += cz * d
        return (abs(jx), abs(jy), abs(jz)), near


ChordTerms = list[tuple[float, float, float, float]]
"""For each joint d, r, w = |d| + r, and half the summands w_i·w_j of (Σw)² for its pairs with itself and with
earlier joints.
"""


def chord_terms(chord: Sequence[float], room: Sequence[float]) -> ChordTerms:
    """Compute the terms that `ForwardKinematics.chord_deviation_bound` needs.

    Args:
        chord: d of each joint, half the chord, rad.
        room: r of each joint, greatest distance from the chord, rad.

    Returns:
        The terms of each joint.
    """
    terms, before = [], 0.0
    for d, r in zip(chord, room, strict=True):
        w = abs(d) + r
        terms.append((d, r, w, w * (before + w / 2.0)))
        before += w
    return terms


def norm(v: Vec3) -> float:
    """Compute the length of a vector.

    Args:
        v: the vector.

    Returns:
        Its Euclidean norm.
    """
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
