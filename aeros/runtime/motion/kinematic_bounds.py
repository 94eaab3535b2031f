"""Upper bounds of a motion: of a point's displacement, and of speed, acceleration and jerk on a whole path.

Frames: B is the robot's base.

Displacement (`ForwardKinematics.displacement_bound`). Let joint i be anywhere within w_i of the joint
position q. Changing one joint after the other moves a point p by at most w_i·ρ_i each, where ρ_i bounds p's
distance from axis i: rotation by φ at distance ρ moves by 2ρ·sin(φ/2) ≤ ρφ. That distance depends only on the
joints beyond i, so ρ_i = (distance at q) + Σ_{j>i} w_j·ρ_j, from the tip inwards.
Every partial derivative of p by joints, of any order, is at most ρ_k long, k the outermost of them: the
innermost derivative is a vector of the length of p's distance from axis k, or less, and each further one
turns it, which lengthens nothing.

Prismatic joints. One moves p along its axis, whatever the posture: its first derivative is the axis, so ρ =
1 (m per m). It turns nothing: a derivative by it of the derivative by a joint further out, or by itself, is
0. So all above holds of it, and in pairs and triples of joints it counts only as the outermost.

Displacement along a chord (`ForwardKinematics.chord_deviation_bound`). Let the joints be at q + λd + ε, λ in
[−1, 1] and |ε_i| ≤ r_i. By Taylor, p is within ½ΣΣρ_max(i,j)·w_i·w_j, w_i = |d_i| + r_i, of the point that
its first derivatives J give, which is λ·Jd + Jε from its place at q, and |Jε| ≤ Σ|J_i|·r_i. In Jd, unlike in
sums of magnitudes, opposite effects of joints cancel. J_i = z_i × (p − o_i), of a prismatic joint z_i.

Timing. s(u) = 10u³ − 15u⁴ + 6u⁵, u = t/T. ds/du = 30u²(1−u)² is greatest at u = 1/2: 15/8.
d²s/du² = 60u(1−u)(1−2u) at u = (1 ± 1/√3)/2: 10/√3. d³s/du³ = 60 − 360u + 360u² at the ends: 60.
So over a straight path of length d: 1.875·d/T, 5.7736·d/T², 60·d/T³ (T. Flash, N. Hogan, J. Neurosci. 5,
1985, is the source of the profile; the peaks follow by setting the next derivative to zero).

Along a path x(s): ẋ = x'ṡ, ẍ = x''ṡ² + x's̈, x⃛ = x'''ṡ³ + 3x''ṡs̈ + x's⃛; each factor is replaced
by its greatest magnitude. A path's jerk is finite only if its second derivative has no jump, which
`is_c2_continuous` checks.

Tool. On a piece of path with parameter x in [0, 1], p' and p'' are exact in the middle m and
|p'''| ≤ L on all of it, so |p'(x)| ≤ max |p'(m) ± p''(m)/2| + L/8 and |p''(x)| ≤ |p''(m)| + L/2 (Taylor).
With A, B, C the greatest |q'|, |q''|, |q'''| and ρ as above,
L = Σρ_i·C_i + 3·ΣΣρ_max(i,j)·B_i·A_j + ΣΣΣρ_max(i,j,k)·A_i·A_j·A_k.
A piece whose bound is too large is halved, which quarters the excess.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import hypot, inf, sqrt
from typing import Final, NamedTuple

from aeros.kinematic_chain import frames_of, is_prismatic, mounting_of
from aeros.runtime.motion.bezier import Derivatives, Piece, derivatives, joint_box, split_in_half
from aeros.runtime.ports import JointPath, JointVector, RobotBody, Vec3

TIMING_PEAKS: Final = (1.875, 10.0 / sqrt(3.0) * (1.0 + 1e-12), 60.0)
"""Greatest |ds/du|, |d²s/du²| and |d³s/du³|."""

_ROUNDING: Final = 1.0 + 1e-9
"""Factor that exceeds the effect of rounding on any bound here."""

_CONTINUITY_TOLERANCE: Final = 1e-9
"""Difference of neighbouring pieces' derivatives that rounding explains, rad."""

_MAX_SUBDIVISIONS: Final = 5
"""Greatest number of times that a piece is halved."""


class ForwardKinematics:
    """Forward kinematics at one joint position `q` (rad; m of prismatic joints).

    Attributes:
        frames: `frames[k]` is the frame of joint k in B, `frames[0]` the base's; m.
        slides: of each joint, True if it is prismatic.
    """

    def __init__(self, body: RobotBody, q: Sequence[float]) -> None:
        self.frames = frames_of(map(mounting_of, body.dh_rows), q)
        self.slides = [*map(is_prismatic, body.dh_rows)]

    def displacement_bound(self, joint: int, p: Vec3, width: Sequence[float]) -> tuple[float, list[float]]:
        """Bound the displacement of a point while each joint stays near its position.

        Args:
            joint: number of joints that move the point.
            p: the point in B, m.
            width: greatest deviation of each joint, rad or m.

        Returns:
            The bound, m, and ρ of each joint that moves the point, m; 1 of a prismatic joint.
        """
        total, reaches = 0.0, [0.0] * joint
        x, y, z = p
        for k in range(joint - 1, -1, -1):
            if self.slides[k]:
                reaches[k] = 1.0
            else:
                origin, _, _, (ax, ay, az) = self.frames[k + 1]
                dx, dy, dz = x - origin[0], y - origin[1], z - origin[2]
                off = hypot(ay * dz - az * dy, az * dx - ax * dz, ax * dy - ay * dx)
                reaches[k] = off + total
            total += width[k] * reaches[k]
        return total, reaches

    def chord_deviation_bound(
        self, joint: int, p: Vec3, along: ChordTerms, standing: int = 0
    ) -> tuple[Vec3, float]:
        """Bound the displacement of a point while the joints stay near a chord.

        Args:
            joint: number of joints that move the point.
            p: the point in B at the middle of the chord, m.
            along: the chord's terms, from `chord_terms`.
            standing: number of joints, from the base, that stand in the middle of the chord.

        Returns:
            Half edges |Jd| of a box around `p`, m, and the greatest distance of the point from that box, m.
        """
        x, y, z = p
        jx = jy = jz = total = near = 0.0
        for k in range(joint - 1, standing - 1, -1):
            (ox, oy, oz), _, _, (ax, ay, az) = self.frames[k + 1]
            d, r, w, pairs = along[k]
            if self.slides[k]:
                cx, cy, cz, off, reach = ax, ay, az, 1.0, 1.0
            else:
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
earlier joints; of these pairs those whose inner joint is prismatic are left out.
"""


def chord_terms(chord: Sequence[float], room: Sequence[float], slides: Sequence[bool]) -> ChordTerms:
    """Compute the terms that `ForwardKinematics.chord_deviation_bound` needs.

    Args:
        chord: d of each joint, half the chord, rad or m.
        room: r of each joint, greatest distance from the chord, rad or m.
        slides: of each joint, True if it is prismatic.

    Returns:
        The terms of each joint.
    """
    terms, before = [], 0.0
    for d, r, is_sliding in zip(chord, room, slides, strict=True):
        w = abs(d) + r
        if is_sliding:
            terms.append((d, r, w, w * before))
        else:
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


class MotionRates(NamedTuple):
    """Bounds of a motion's rates; of a revolute joint or a rotation in rad, of a translation in m.

    Attributes:
        speed: rad/s or m/s.
        acceleration: rad/s² or m/s².
        jerk: rad/s³ or m/s³.
    """

    speed: float
    acceleration: float
    jerk: float


def rates_in_time(first: float, second: float, third: float, duration: float) -> MotionRates:
    """Convert bounds of the derivatives by s to bounds of the derivatives by time.

    Args:
        first: bound of |x'|, in m or rad.
        second: bound of |x''|.
        third: bound of |x'''|.
        duration: duration of the motion, s.

    Returns:
        The bounds in time.
    """
    v, a, j = TIMING_PEAKS[0] / duration, TIMING_PEAKS[1] / duration**2, TIMING_PEAKS[2] / duration**3
    return MotionRates(
        first * v * _ROUNDING,
        (second * v * v + first * a) * _ROUNDING,
        (third * v**3 + 3.0 * second * v * a + first * j) * _ROUNDING,
    )


def is_c2_continuous(path: JointPath) -> bool:
    """Check a path for continuity up to the second derivative.

    Args:
        path: a joint path.

    Returns:
        True if neighbouring pieces meet with equal position, first and second derivative.
    """
    for left, right in pairwise(path):
        for _, b, c, d, e, f, g, _ in zip(*left, *right, strict=True):
            slope, bend = (d - c) - (f - e), (b - 2.0 * c + d) - (e - 2.0 * f + g)
            if not (
                abs(d - e) <= _CONTINUITY_TOLERANCE
                and abs(slope) <= _CONTINUITY_TOLERANCE
                and abs(bend) <= _CONTINUITY_TOLERANCE
            ):
                return False
    return True


def joint_rates(path: JointPath, duration: float) -> list[MotionRates]:
    """Bound the rates of each joint along a path.

    Args:
        path: a joint path.
        duration: duration of the motion, s.

    Returns:
        The bounds of each joint in rad/s, rad/s², rad/s³; of a prismatic joint in m/s, m/s², m/s³.
    """
    n = float(len(path))
    known = [derivatives(piece) for piece in path]
    columns = zip(
        zip(*(one.max_first for one in known), strict=True),
        zip(*(one.max_second for one in known), strict=True),
        zip(*(one.third for one in known), strict=True),
        strict=True,
    )
    return [rates_in_time(max(a) * n, max(b) * n**2, max(c) * n**3, duration) for a, b, c in columns]


def base_rates(way: Vec3, duration: float) -> MotionRates:
    """Bound the rates of a base that travels straight.

    Args:
        way: its displacement, m.
        duration: duration of the motion, s.

    Returns:
        The bounds in m/s, m/s², m/s³.
    """
    return rates_in_time(norm(way), 0.0, 0.0, duration)


def add_rates(relative: MotionRates, carried: MotionRates) -> MotionRates:
    """Bound the rates of a point that moves relative to a carrier that does not turn.

    Args:
        relative: the point's rates relative to the carrier.
        carried: the carrier's rates.

    Returns:
        The sums.
    """
    return MotionRates(*(a + b for a, b in zip(relative, carried, strict=True)))


def tool_rates(
    body: RobotBody, path: JointPath, duration: float, speed_limit: float
) -> tuple[MotionRates, MotionRates]:
    """Bound the rates of the tool point relative to the base, and those of its rotation.

    Args:
        body: the robot.
        path: its joint path.
        duration: duration of the motion, s.
        speed_limit: the tool's, m/s; pieces are halved until their bound is below it, at most
            `_MAX_SUBDIVISIONS` times. If it is not positive, pieces are not halved: no bound could be below.

    Returns:
        The bounds of the tool point (m/s, m/s², m/s³) and of its rotation (rad/s, rad/s², rad/s³).
    """
    n = float(len(path))
    most = [0.0] * 6
    allowed = speed_limit * duration / TIMING_PEAKS[0] / _ROUNDING / n if speed_limit > 0.0 else inf
    for piece in path:
        most = [max(pair) for pair in zip(most, _piece(body, piece, allowed, 0), strict=True)]
    moving = rates_in_time(most[0] * n, most[1] * n**2, most[2] * n**3, duration)
    return moving, rates_in_time(most[3] * n, most[4] * n**2, most[5] * n**3, duration)


def piece_speeds(body: RobotBody, path: JointPath, duration: float) -> list[float]:
    """Bound the speed of the tool point relative to the base on each piece of a path.

    Args:
        body: the robot.
        path: its joint path.
        duration: duration of the motion, s.

    Returns:
        The bound on each piece, m/s.
    """
    n = float(len(path))
    return [
        _piece(body, piece, 0.0, _MAX_SUBDIVISIONS - 2)[0]
        * n
        * _timing_rate(number / n, (number + 1) / n)
        / duration
        * _ROUNDING
        for number, piece in enumerate(path)
    ]


def _timing_rate(low: float, high: float) -> float:
    """Bound s'(u) = 30u²(1 − u)² where s(u) is in [low, high]; it rises until u = s = 1/2, then falls."""
    s = min(high, 1.0 - low)
    below, above = 0.0, 0.5
    for _ in range(30):
        u = (below + above) / 2.0
        if u * u * u * (10.0 - 15.0 * u + 6.0 * u * u) < s:
            below = u
        else:
            above = u
    return 30.0 * above * above * (1.0 - above) * (1.0 - above)


def _piece(body: RobotBody, piece: Piece, allowed: float, depth: int) -> list[float]:
    """Bound |p'|, |p''|, |p'''| and the same of the rotation, by the parameter of the piece."""
    bounds = _bounds(body, piece)
    if bounds[0] <= allowed or depth == _MAX_SUBDIVISIONS:
        return bounds
    # By the parameter of a half, which runs twice as fast.
    parts = [_piece(body, half, allowed / 2.0, depth + 1) for half in split_in_half(piece)]
    scale = (2.0, 4.0, 8.0) * 2
    return [max(pair) * factor for *pair, factor in zip(*parts, scale, strict=True)]


def _bounds(body: RobotBody, piece: Piece) -> list[float]:
    known = derivatives(piece)
    a, b, c, d = piece
    q_middle = tuple([(p + 3.0 * (q + r) + s) / 8.0 for p, q, r, s in zip(a, b, c, d, strict=True)])
    posture = ForwardKinematics(body, q_middle)
    tool = posture.frames[-1].to_base(body.tool_offset)
    box = joint_box([piece])
    # Everything in the box is within its width and its middle's distance of the posture in the middle.
    width = [w + abs(m - q) for w, m, q in zip(box.width, box.middle, q_middle, strict=True)]
    _, reaches = posture.displacement_bound(len(q_middle), tool, width)
    third = _third_derivative_bound(reaches, known, posture.slides)
    first_at, second_at, turn_at = _point_derivatives(posture, tool, known.first, known.second)
    ends = max(norm(_add_scaled(first_at, second_at, 0.5)), norm(_add_scaled(first_at, second_at, -0.5)))
    sa, sb, sc = (
        _sum_of_turns(column, posture.slides) for column in (known.max_first, known.max_second, known.third)
    )
    bend = sb + 0.5 * sa * sa
    return [
        ends + third / 8.0,
        norm(second_at) + third / 2.0,
        third,
        norm(turn_at) + bend / 2.0,
        bend,
        sc + 3.0 * sa * sb + 1.5 * sa**3,
    ]


def _sum_of_turns(column: JointVector, slides: Sequence[bool]) -> float:
    """Sum a column over the joints that turn; a prismatic joint does not turn the tool."""
    return sum([one for one, is_sliding in zip(column, slides, strict=True) if not is_sliding], 0.0)


def _third_derivative_bound(reaches: list[float], known: Derivatives, slides: Sequence[bool]) -> float:
    """Compute L: the sums over all pairs and triples of joints, grouped by their outermost joint.

    A prismatic joint is in pairs and triples with joints further in that turn, once in each.
    """
    total = sa = sb = 0.0
    columns = zip(reaches, known.max_first, known.max_second, known.third, slides, strict=True)
    for reach, a, b, c, is_sliding in columns:
        if is_sliding:
            total += reach * (c + 3.0 * (a * sb + b * sa) + 3.0 * a * sa**2)
            continue
        pairs, triples = sa * sb, sa**3
        sa += a
        sb += b
        total += reach * (c + 3.0 * (sa * sb - pairs) + (sa**3 - triples))
    return total


def _point_derivatives(
    posture: ForwardKinematics, tool: Vec3, first: JointVector, second: JointVector
) -> tuple[Vec3, Vec3, Vec3]:
    """Compute p', p'' and the rate of rotation from the joints' derivatives.

    p'' = Σ_i J_i·q''_i + (2·Σ_{j<i} z_j·q'_j + z_i·q'_i) × J_i·q'_i, J_i = z_i × (p − o_i), where sums of
    z_j and the summand z_i are over joints that turn; of a prismatic joint J_i = z_i.
    """
    px, py, pz = tool
    vx = vy = vz = cx = cy = cz = wx = wy = wz = 0.0
    joints = zip(posture.frames[1:], posture.slides, first, second, strict=True)
    for ((ox, oy, oz), _, _, (zx, zy, zz)), is_sliding, rate, bend in joints:
        if is_sliding:
            jx, jy, jz = zx, zy, zz
            ax, ay, az = jx * rate, jy * rate, jz * rate
            zx = zy = zz = 0.0
        else:
            dx, dy, dz = px - ox, py - oy, pz - oz
            jx, jy, jz = zy * dz - zz * dy, zz * dx - zx * dz, zx * dy - zy * dx
            ax, ay, az = jx * rate, jy * rate, jz * rate
            zx, zy, zz = zx * rate, zy * rate, zz * rate
        tx, ty, tz = 2.0 * wx + zx, 2.0 * wy + zy, 2.0 * wz + zz
        cx += jx * bend + ty * az - tz * ay
        cy += jy * bend + tz * ax - tx * az
        cz += jz * bend + tx * ay - ty * ax
        vx, vy, vz = vx + ax, vy + ay, vz + az
        wx, wy, wz = wx + zx, wy + zy, wz + zz
    return (vx, vy, vz), (cx, cy, cz), (wx, wy, wz)


def _add_scaled(a: Vec3, b: Vec3, factor: float) -> Vec3:
    return (a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2])
