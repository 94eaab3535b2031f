"""Bounds on how far a box of joint positions moves a point of a robot.

Frames: B, the robot's base.  The bound of `ForwardKinematics.displacement_bound`: let joint i be anywhere
    within w_i of the
posture.  Changing one joint after the other moves a point p by at most w_i·ρ_i each, where ρ_i bounds
p's distance from axis i: rotation by φ at distance ρ moves by 2ρ·sin(φ/2) ≤ ρφ.  That distance depends on
the joints beyond i alone, so ρ_i = (distance in the posture) + Σ_{j>i} w_j·ρ_j, from the tip inwards.
Every partial derivative of p by joints, of any order, is at most ρ_k long, k the outermost of them:
the innermost derivative is a vector of the length of p's distance from axis k, or less, and each further
one turns it, which lengthens nothing.

The bound of `ForwardKinematics.chord_deviation_bound`: let the joints be at q + λd + ε, λ in [−1, 1] and
|ε_i| ≤ r_i.  By Taylor p
is within ½ΣΣρ_max(i,j)·w_i·w_j, w_i = |d_i| + r_i, of the place that its first derivatives J send it to,
which is λ·Jd + Jε from where it is at q, and |Jε| ≤ Σ|J_i|·r_i.  In Jd, unlike in sums of magnitudes,
what joints do against each other cancels.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, sqrt

from aeros.kinematic_chain import frames_of, mounting_of
from aeros.runtime.ports import RobotBody, Vec3


class ForwardKinematics:
    """One joint position `q` of a body, m and rad; `frames[k]` is that of joint k, 0 the base's."""

    def __init__(self, body: RobotBody, q: Sequence[float]) -> None:
        self.frames = frames_of(map(mounting_of, body.dh_rows), q)

    def displacement_bound(self, joint: int, p: Vec3, width: Sequence[float]) -> tuple[float, list[float]]:
        """How far a point at `p` (B), moved by the first `joint` joints, gets within `width`; and each ρ."""
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
        """How a point at `p` (B), moved by the first `joint` joints, stays near a box around `p`.

        The box's half edges, |Jd|, and how near.
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
"""Of each joint d, r, w = |d| + r, and half of what its pairs with itself and with those before it add to
the square of the sum of all w."""


def chord_terms(chord: Sequence[float], room: Sequence[float]) -> ChordTerms:
    """What `ForwardKinematics.chord_deviation_bound` takes of d and r."""
    found, before = [], 0.0
    for d, r in zip(chord, room, strict=True):
        w = abs(d) + r
        found.append((d, r, w, w * (before + w / 2.0)))
        before += w
    return found


def norm(v: Vec3) -> float:
    """Its length."""
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
