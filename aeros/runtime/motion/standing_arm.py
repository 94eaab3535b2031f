"""Two arms on one body, one of which moves: the body of the moving arm, with the other where it stands.

A branch of a tree of links that stands still is rigid: its hulls and balls move with the link that carries
it. So the sweep keeps the links of both arms apart, and all of them off barriers, as it does for one chain.
A joint of the arm that stands may be off its posture by a tolerance; each hull and each ball is enlarged by
the way that this moves it (`ForwardKinematics.displacement_bound`).

Not modelled: what the standing arm holds. Barriers that name `links` hold for the standing arm only if they
name its links, prefix included.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from itertools import chain
from math import isfinite
from operator import sub
from typing import Final, NamedTuple

from aeros.kinematic_chain import JointFrame
from aeros.runtime.motion.kinematic_bounds import ForwardKinematics
from aeros.runtime.ports import Ball, Hull, JointVector, RobotBody, Vec3

_RIGID: Final = 1e-9
"""Greatest error of the axes of a frame, as rounding makes it."""


class StandingArm(NamedTuple):
    """The place of an arm that stands, on the body of one that moves.

    Attributes:
        prefix: prefix of its links' names.
        place: pose of its base in the frame of the joint that carries it, m.
        joint: number of joints of the moving arm that carry it; 0 if both stand on one base.
    """

    prefix: str
    place: JointFrame
    joint: int = 0


def with_standing_arm(
    body: RobotBody, other: RobotBody, mount: StandingArm, posture: JointVector, tolerance: JointVector
) -> RobotBody:
    """Add an arm that stands to the body of one that moves.

    Links of the arm that stands are compared with those of the moving arm, and with those that fewer joints
    move than the link that carries it; not with that link, nor with each other.

    Args:
        body: the arm that moves.
        other: the arm that stands.
        mount: where it is mounted, and the prefix of its links' names.
        posture: position of each of its joints, rad or m.
        tolerance: greatest deviation of each joint from there while the other arm moves, rad or m.

    Returns:
        The moving chain with the balls and hulls of both arms.

    Raises:
        ValueError: a link of both arms has the same name; `posture` or `tolerance` has not one finite number
            for each joint of the arm that stands, or a tolerance is negative; or the moving arm has no such
            joint as carries it, or its place is no rotation and translation.
    """
    _check(body, other, mount, posture, tolerance)
    standing = ForwardKinematics(other, posture)
    names, other_names = (
        {ball.link for ball in one.balls} | {hull.link for hull in one.hulls} for one in (body, other)
    )
    doubled = names & {f"{mount.prefix}{name}" for name in other_names}
    if doubled:
        raise ValueError(f"both arms have a link `{min(doubled)}`; choose another prefix")

    def carried(joint: int, corners: Iterable[Vec3]) -> tuple[tuple[Vec3, ...], float]:
        """Return points in the frame that carries the arm, and the most that the tolerance moves one."""
        places = [standing.frames[joint].to_base(corner) for corner in corners]
        moved = [standing.displacement_bound(joint, place, tolerance)[0] for place in places]
        return tuple([mount.place.to_base(place) for place in places]), max(moved)

    balls, hulls = [], []
    for ball in other.balls:
        (centre,), moved = carried(ball.joint, (ball.centre,))
        balls.append(Ball(f"{mount.prefix}{ball.link}", mount.joint, centre, ball.radius + moved))
    for hull in other.hulls:
        corners, moved = carried(hull.joint, hull.corners)
        hulls.append(Hull(f"{mount.prefix}{hull.link}", mount.joint, corners, hull.radius + moved))
    return replace(body, balls=(*body.balls, *balls), hulls=(*body.hulls, *hulls))


def _check(
    body: RobotBody, other: RobotBody, mount: StandingArm, posture: JointVector, tolerance: JointVector
) -> None:
    """Check the numbers of an arm that stands.

    Raises:
        ValueError: with one of them the arm would be too small or misplaced.
    """
    joints = len(other.dh_rows)
    for name, numbers in (("positions", posture), ("tolerances", tolerance)):
        if len(numbers) != joints or not all(map(isfinite, numbers)):
            raise ValueError(f"{joints} finite {name} are needed, one for each joint; these are {numbers}")
    if min(tolerance) < 0.0:
        raise ValueError(f"a tolerance of {min(tolerance)} is below 0")
    if not 0 <= mount.joint <= len(body.dh_rows):
        raise ValueError(f"no {mount.joint} joints carry the arm: the moving arm has {len(body.dh_rows)}")
    origin, x, y, z = mount.place
    normal = (x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0])
    products = [sum(a * b for a, b in zip(one, two, strict=True)) for one, two in ((x, x), (y, y), (x, y))]
    errors = [*map(sub, chain(normal, products), (*z, 1.0, 1.0, 0.0))]
    # Compare each, because `max` may hide a NaN.
    if not (all(map(isfinite, origin)) and all(abs(one) <= _RIGID for one in errors)):
        raise ValueError(f"the place of the arm is no rotation and translation: {mount.place}")
