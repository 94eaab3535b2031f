"""Forward kinematics of a chain of revolute and prismatic joints, for one joint position, without NumPy.

This is the only scalar implementation: the gate bounds motions with it, and simulators place their robot with
it. It lies below both layers because neither may import the other. `aeros.sim.robot.kinematics.forward`
computes many joint positions at once, with NumPy.

Frames: B is the robot's base. A link has the frame of the joint that moves it; a revolute joint turns it
about its z, a prismatic joint slides it along its z.
Units: positions of joints are rad, of prismatic joints m.
Source: J. J. Craig, Introduction to Robotics, modified Denavit-Hartenberg parameters.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import combinations
from math import asin, atan2, cos, sin
from typing import Final, NamedTuple, Protocol, TypeVar

Triple = tuple[float, float, float]
Row = (
    tuple[float, float, float] | tuple[float, float, float, float] | tuple[float, float, float, float, float]
)
"""Modified Denavit-Hartenberg parameters of a joint: a (m), alpha (rad), d (m); theta at position 0 (rad).

Without the fourth, theta at position 0 is 0. A fifth number, `PRISMATIC`, says that the joint slides: its
position adds to d. Without it the joint turns: its position adds to theta.
"""

PRISMATIC: Final = 1.0
"""Fifth number of the row of a prismatic joint."""


class JointFrame(NamedTuple):
    """A link's frame in B; the joint turns the link about `z`, or slides it along `z`.

    Attributes:
        origin: its origin, m.
        x, y, z: its unit axes.
    """

    origin: Triple
    x: Triple
    y: Triple
    z: Triple

    def to_base(self, p: Triple) -> Triple:
        """Transform a point from this frame to B.

        Args:
            p: position in this frame, m.

        Returns:
            The position in B, m.
        """
        (ox, oy, oz), (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = self
        a, b, c = p
        return (ox + a * xx + b * yx + c * zx, oy + a * xy + b * yy + c * zy, oz + a * xz + b * yz + c * zz)

    def rotate_to_base(self, v: Triple) -> Triple:
        """Express a vector of this frame in B.

        Args:
            v: the vector in this frame.

        Returns:
            The same vector in B.
        """
        _, (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = self
        a, b, c = v
        return (a * xx + b * yx + c * zx, a * xy + b * yy + c * zy, a * xz + b * yz + c * zz)

    def rotate_from_base(self, v: Triple) -> Triple:
        """Express a vector of B in this frame.

        Args:
            v: the vector in B.

        Returns:
            The same vector in this frame.
        """
        a, b, c = v
        _, (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = self
        return (a * xx + b * xy + c * xz, a * yx + b * yy + c * yz, a * zx + b * zy + c * zz)


ORIGIN: Final = JointFrame((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
"""Frame of the base itself."""


_GIMBAL_LOCK: Final = 1e-6
"""Cosine of the pitch below which roll and yaw turn about the same axis."""

Mounting = tuple[float, float, float, float, float, float, bool]
"""Mounting of a joint on the link before it: the part of its transform that its position does not change.

The joint's origin at position 0 in the frame before it (x, y, z in m), the cosine and sine of the twist
alpha, theta at position 0 (rad), and True if the joint is prismatic.
"""


def mounting_of(row: Row) -> Mounting:
    """Compute the constants of a joint's transform.

    It is Rx(alpha)·Tx(a)·Rz(zero + position)·Tz(d), of a prismatic joint Rx(alpha)·Tx(a)·Rz(zero)·Tz(d +
    position).

    Args:
        row: the joint's modified Denavit-Hartenberg parameters.

    Returns:
        The part of the transform that does not depend on the joint's position.
    """
    a, alpha, d, *_ = row
    cos_twist, sin_twist = cos(alpha), sin(alpha)
    return (a, -sin_twist * d, cos_twist * d, cos_twist, sin_twist, zero_angle(row), is_prismatic(row))


def is_prismatic(row: Row) -> bool:
    """Read the kind of a joint.

    Args:
        row: the joint's modified Denavit-Hartenberg parameters.

    Returns:
        True if the joint slides along its axis, False if it turns about it.
    """
    return len(row) == 5


def position_unit(row: Row) -> str:
    """Name the unit of a joint's position.

    Args:
        row: the joint's modified Denavit-Hartenberg parameters.

    Returns:
        `m` if the joint slides along its axis, `rad` if it turns about it.
    """
    return "m" if is_prismatic(row) else "rad"


def zero_angle(row: Row) -> float:
    """Return the angle theta of a joint at its position 0.

    Args:
        row: the joint's modified Denavit-Hartenberg parameters.

    Returns:
        The angle, rad.
    """
    return row[3] if len(row) > 3 else 0.0


def roll_pitch_yaw(row: Row) -> Triple:
    """Compute the turn of a joint's frame at position 0 as URDF writes it: Rz(yaw)·Ry(pitch)·Rx(roll).

    Args:
        row: the joint's modified Denavit-Hartenberg parameters.

    Returns:
        Roll, pitch and yaw, rad.
    """
    alpha, zero = row[1], zero_angle(row)
    if not zero:
        return (alpha, 0.0, 0.0)
    c, s, ct, st = cos(zero), sin(zero), cos(alpha), sin(alpha)
    pitch = -asin(max(-1.0, min(1.0, st * s)))
    if cos(pitch) < _GIMBAL_LOCK:
        return (atan2(st, ct * c), pitch, 0.0)
    return (atan2(st * c, ct), pitch, atan2(ct * s, c))


def child_frame(frame: JointFrame, mounting: Mounting, position: float) -> JointFrame:
    """Compute the frame of the next joint of the chain.

    Recorded simulations depend on the order of the additions in this function.

    Args:
        frame: frame in B of the joint before it, or `ORIGIN`.
        mounting: constants of the joint, from `mounting_of`.
        position: position of the joint, rad or m.

    Returns:
        The joint's frame in B.
    """
    (ox, oy, oz), (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = frame
    a, b, e, ct, st, zero, slides = mounting
    if slides:
        b, e, turn = b - st * position, e + ct * position, zero
    else:
        turn = position + zero
    c, s = cos(turn), sin(turn)
    sct, sst, cct, cst = s * ct, s * st, c * ct, c * st
    return JointFrame(
        (
            ox + (a * xx + b * yx + e * zx),
            oy + (a * xy + b * yy + e * zy),
            oz + (a * xz + b * yz + e * zz),
        ),
        (
            c * xx + sct * yx + sst * zx,
            c * xy + sct * yy + sst * zy,
            c * xz + sct * yz + sst * zz,
        ),
        (
            cct * yx - s * xx + cst * zx,
            cct * yy - s * xy + cst * zy,
            cct * yz - s * xz + cst * zz,
        ),
        (ct * zx - st * yx, ct * zy - st * yy, ct * zz - st * yz),
    )


def frames_of(mountings: Iterable[Mounting], q: Sequence[float]) -> list[JointFrame]:
    """Compute the frames of all links at one joint position.

    Args:
        mountings: constants of each joint, from the base outwards.
        q: position of each joint, rad or m, in the same order.

    Returns:
        The frames in B: the base's first, then each joint's.

    Raises:
        ValueError: `q` and `mountings` have different lengths.
    """
    frames = [ORIGIN]
    for mounting, position in zip(mountings, q, strict=True):
        frames.append(child_frame(frames[-1], mounting, position))
    return frames


def point_derivative(frame: JointFrame, mounting: Mounting, p: Triple) -> Triple:
    """Compute the derivative of a point by the position of a joint that moves it.

    Args:
        frame: the joint's frame in B.
        mounting: constants of the joint, from `mounting_of`.
        p: the point in B, m.

    Returns:
        z × (p − o) in B, m/rad; of a prismatic joint z, m/m.
    """
    (ox, oy, oz), _, _, (zx, zy, zz) = frame
    if mounting[-1]:
        return (zx, zy, zz)
    x, y, z = p
    dx, dy, dz = x - ox, y - oy, z - oz
    return (zy * dz - zz * dy, zz * dx - zx * dz, zx * dy - zy * dx)


class LinkOfChain(Protocol):
    """A link, of which a chain may have several that the same joints move."""

    @property
    def link(self) -> str:
        """The link's name."""

    @property
    def joint(self) -> int:
        """Number of joints that move it."""


LinkT = TypeVar("LinkT", bound=LinkOfChain)


def pairs_that_may_meet(links: Iterable[LinkT], exempt: Iterable[Sequence[str]]) -> list[tuple[LinkT, LinkT]]:
    """List the pairs of links that move relative to each other and are not exempt.

    Args:
        links: the links.
        exempt: names of two links each that need no check.

    Returns:
        The pairs; the link with fewer joints between it and the base comes first.
    """
    left_out = {frozenset(pair) for pair in exempt}
    outwards = sorted(links, key=lambda one: one.joint)
    return [
        (inner, outer)
        for inner, outer in combinations(outwards, 2)
        if inner.joint < outer.joint and frozenset((inner.link, outer.link)) not in left_out
    ]
