"""Further arms on a robot's body, which stand: the body of the moving arm, with the others where they stand.

A branch of a tree of links that stands still is rigid: its hulls and balls move with the link that carries
it. So the sweep keeps the links of all arms apart, and all of them off barriers, as it does for one chain.
A joint of an arm that stands may be off its posture by a tolerance; each hull and each ball is enlarged by
the way that this moves it, and distances from people are less by it.

Not modelled: what a standing arm holds; its fingers are closed. Barriers that name `links` hold for a
standing arm only if they name its links, prefix included.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import chain, islice, product
from math import dist, isfinite
from typing import Final

import numpy as np

from aeros.kinematic_chain import (
    PRISMATIC,
    Row,
    Triple,
    frames_of,
    is_prismatic,
    mounting_of,
    position_unit,
    zero_angle,
)
from aeros.runtime.ports import Ball, Hull, JointVector, RobotBody, Vec3
from aeros.sim.robot.body import Capsule
from aeros.sim.robot.model import ArmMount, RobotModel, StandingArm
from aeros.sim.robot.self_contact import are_near, find_self_contact

_FOOT: Final = "foot"
"""Name of the link of an arm that no joint of it moves."""


def with_standing_arms(model: RobotModel, arms: Iterable[StandingArm]) -> RobotModel:
    """Add arms that stand to a robot.

    Args:
        model: the robot.
        arms: arms that stand on it.

    Returns:
        The robot; its body, capsules and list of standing arms have these, too.

    Raises:
        ValueError: as `with_standing_arm`.
    """
    added = tuple(arms)
    body, capsules = model.body, [*model.capsules]
    for arm in added:
        body = with_standing_arm(body, arm.model.body, arm.mount, arm.posture, arm.tolerance)
        capsules += _carried_capsules(arm)
    standing = (*model.standing_arms, *added)
    return replace(model, body=body, capsules=tuple(capsules), standing_arms=standing)


def with_standing_arm(
    body: RobotBody, other: RobotBody, mount: ArmMount, posture: JointVector, tolerance: JointVector
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
            joint as carries it, or its place is not finite.
    """
    _check(body, other, mount, posture, tolerance)
    frames, place = frames_of(map(mounting_of, other.dh_rows), posture), mount.frame

    def carried(joint: int, corners: Iterable[Vec3]) -> tuple[tuple[Vec3, ...], float]:
        """Return points in the frame that carries the arm, and the most that the tolerance moves one."""
        places = [frames[joint].to_base(corner) for corner in corners]
        moved = max(_displacement(other, posture, tolerance, joint, one) for one in places)
        return tuple([place.to_base(one) for one in places]), moved

    balls, hulls = [], []
    for ball in other.balls:
        (centre,), moved = carried(ball.joint, (ball.centre,))
        balls.append(Ball(f"{mount.prefix}{ball.link}", mount.joint, centre, ball.radius + moved))
    for hull in other.hulls:
        corners, moved = carried(hull.joint, hull.corners)
        hulls.append(Hull(f"{mount.prefix}{hull.link}", mount.joint, corners, hull.radius + moved))
    return replace(body, balls=(*body.balls, *balls), hulls=(*body.hulls, *hulls))


@lru_cache(maxsize=16)
def with_postures(model: RobotModel, postures: tuple[tuple[str, JointVector], ...]) -> RobotModel:
    """Let standing arms stand elsewhere.

    Args:
        model: the robot.
        postures: prefix of an arm, and position of each of its joints, rad or m.

    Returns:
        The robot; equal arguments give the same one.
    """
    new = dict(postures)
    count = len(_own_hulls(model))
    names = {hull.link for hull in model.body.hulls[:count]}
    body = replace(
        model.body,
        balls=tuple(ball for ball in model.body.balls if ball.link in names),
        hulls=model.body.hulls[:count],
    )
    capsules = tuple(one for one in model.capsules if one.link in names)
    arms = [replace(arm, posture=new.get(arm.mount.prefix, arm.posture)) for arm in model.standing_arms]
    return with_standing_arms(replace(model, body=body, capsules=capsules, standing_arms=()), arms)


def joints_outside(model: RobotModel, posture: JointVector) -> Iterator[tuple[int, str]]:
    """Find the joints of a posture that are outside of an arm's limits.

    Args:
        model: the arm.
        posture: position of each of its joints (n,), rad or m.

    Yields:
        The joint, counted from 0, and a sentence about it.
    """
    limits = zip(posture, model.limits.lowest.tolist(), model.limits.highest.tolist(), strict=True)
    for joint, (value, low, high) in enumerate(limits):
        if not low <= value <= high:
            yield (
                joint,
                f"joint {joint + 1} of `{model.name}` stands at {value:.7g} "
                f"{position_unit(model.body.dh_rows[joint])}, outside of its limits, {low:.7g} to {high:.7g}",
            )


def fixed_in_posture(arm: StandingArm) -> RobotModel:
    """Move the posture of a standing arm into its chain.

    Args:
        arm: the arm.

    Returns:
        A robot that is with all joints at 0 where the arm stands.
    """
    rows = tuple(map(_row_at, arm.model.body.dh_rows, arm.posture))
    return replace(arm.model, body=replace(arm.model.body, dh_rows=rows))


def find_overlap(model: RobotModel) -> tuple[str, str] | None:
    """Search for a standing arm that overlaps another link in the robot's ready posture, or itself.

    A foot may touch what carries it, and other feet.

    Args:
        model: the robot.

    Returns:
        The names of two links whose hulls overlap, that of a standing arm last; None if none is found.
    """
    frames = frames_of(model.mountings, model.postures.ready.tolist())
    corners = {one.link: np.array([*map(frames[one.joint].to_base, one.corners)]) for one in model.body.hulls}
    for arm in model.standing_arms:
        found = find_self_contact(arm.model, arm.posture)
        if found is not None:
            first, second = (f"{arm.mount.prefix}{link}" for link in found)
            return first, second
    for one, other in _pairs_of_standing(model):
        if are_near(corners[one.link], corners[other.link], one.radius + other.radius):
            return one.link, other.link
    return None


def _own_hulls(model: RobotModel) -> tuple[Hull, ...]:
    """Return the hulls of the arm that moves; those of standing arms come after them."""
    count = len(model.body.hulls) - sum(len(arm.model.body.hulls) for arm in model.standing_arms)
    return model.body.hulls[:count]


def _pairs_of_standing(model: RobotModel) -> Iterator[tuple[Hull, Hull]]:
    """Yield the hulls to compare, that of a standing arm last."""
    own = _own_hulls(model)
    standing, others = iter(model.body.hulls[len(own) :]), [own]
    for arm in model.standing_arms:
        hulls = tuple(islice(standing, len(arm.model.body.hulls)))
        for one, other in product(chain.from_iterable(others), hulls):
            may_touch = one.joint == other.joint and other.link.endswith(_FOOT)
            if not may_touch or not (one in own or one.link.endswith(_FOOT)):
                yield one, other
        others.append(hulls)


def _row_at(row: Row, position: float) -> Row:
    length, twist, offset, *_ = row
    if is_prismatic(row):
        return (length, twist, offset + position, zero_angle(row), PRISMATIC)
    return (length, twist, offset, zero_angle(row) + position)


def _displacement(
    body: RobotBody, posture: JointVector, tolerance: JointVector, joint: int, point: Triple
) -> float:
    """Bound the way of a point, which `joint` joints move, while each joint is within its tolerance, m.

    The joints go to where they are one after the other, the last one first. Each turns the point, which has
    moved already, about an axis that is still in its place; a chord is no longer than its arc.
    """
    moved = 0.0
    for (place, axis), slides, room in [*zip(*_axes(body, posture), tolerance, strict=True)][:joint][::-1]:
        moved += room if slides else room * (_from_axis(point, place, axis) + moved)
    return moved


def _axes(body: RobotBody, posture: Sequence[float]) -> tuple[list[tuple[Triple, Triple]], list[bool]]:
    frames = frames_of(map(mounting_of, body.dh_rows), posture)
    return [(one.origin, one.z) for one in frames[1:]], [*map(is_prismatic, body.dh_rows)]


def _from_axis(point: Triple, place: Triple, axis: Triple) -> float:
    """Return the distance of a point from a line, m."""
    along = sum((a - b) * c for a, b, c in zip(point, place, axis, strict=True))
    foot = [b + along * c for b, c in zip(place, axis, strict=True)]
    return dist(point, foot)


def _carried_capsules(arm: StandingArm) -> Iterator[Capsule]:
    """Yield the capsules of an arm in the frame of the joint that carries it."""
    frames, mount = frames_of(arm.model.mountings, arm.posture), arm.mount
    for one in arm.model.capsules:
        ends = [frames[one.joint].to_base(end) for end in (one.a, one.b)]
        moved = max(_displacement(arm.model.body, arm.posture, arm.tolerance, one.joint, end) for end in ends)
        a, b = map(mount.frame.to_base, ends)
        yield Capsule(f"{mount.prefix}{one.link}", mount.joint, a, b, one.radius, one.slack + moved)


def _check(
    body: RobotBody, other: RobotBody, mount: ArmMount, posture: JointVector, tolerance: JointVector
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
    if not all(map(isfinite, chain(mount.at, mount.roll_pitch_yaw))):
        raise ValueError(f"the place of the arm is not finite: {mount.at}, {mount.roll_pitch_yaw}")
    names, other_names = (
        {ball.link for ball in one.balls} | {hull.link for hull in one.hulls} for one in (body, other)
    )
    doubled = names & {f"{mount.prefix}{name}" for name in other_names}
    if doubled:
        raise ValueError(f"both arms have a link `{min(doubled)}`; choose another prefix")
