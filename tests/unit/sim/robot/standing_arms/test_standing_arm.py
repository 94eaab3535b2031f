"""Two arms on one base: what the sweep says of the one that moves, against sampled postures of both."""

from __future__ import annotations

from dataclasses import replace
from math import dist, inf, nan, pi
from random import Random

import numpy as np
import pytest

from aeros.kinematic_chain import PRISMATIC, frames_of, mounting_of
from aeros.runtime.motion.bezier import Piece
from aeros.runtime.motion.link_distance import find_link_contact, search_separation
from aeros.runtime.motion.swept_volume import BarrierBox, Enclosure, SweptMotion, find_breach
from aeros.runtime.ports import Ball, Hull, JointVector, RobotBody, Vec3
from aeros.sim.geometry import Pose, to_world
from aeros.sim.pictures.urdf_model import roll_pitch_yaw
from aeros.sim.robot.model import ArmMount
from aeros.sim.robot.standing_arms.standing_arm import with_standing_arm
from tests.unit.sim.robot.panda import PANDA_BODY, Q_MAX, Q_MIN, READY_POSTURE

BESIDE = ArmMount("left_", (0.0, 0.45, 0.0))
"""Both arms on one base, 45 cm apart."""

READY: JointVector = tuple(READY_POSTURE.tolist())
STILL = (0.0,) * 7
CLEARANCE = 0.01


def line(start: JointVector, end: JointVector) -> Piece:
    a, b, c, d = (
        tuple(x + third / 3.0 * (y - x) for x, y in zip(start, end, strict=True)) for third in range(4)
    )
    return a, b, c, d


def swept(body: RobotBody, start: JointVector, end: JointVector) -> SweptMotion:
    return SweptMotion(body, ([line(start, end)],), STILL, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), True)


def corners_at(body: RobotBody, q: JointVector, at: Vec3 = (0.0, 0.0, 0.0)) -> dict[str, list[Vec3]]:
    frames = frames_of(map(mounting_of, body.dh_rows), q)
    x, y, z = at
    return {
        hull.link: [(a + x, b + y, c + z) for a, b, c in map(frames[hull.joint].to_base, hull.corners)]
        for hull in body.hulls
    }


def arms_are_apart(mine: dict[str, list[Vec3]], theirs: dict[str, list[Vec3]]) -> bool:
    radii = {hull.link: hull.radius for hull in PANDA_BODY.hulls}
    return all(
        search_separation(
            a, [Enclosure(p, (0.0, 0.0, 0.0), 0.0) for p in b], radii[one] + radii[other] + 1e-6
        ).direction
        is not None
        for one, a in mine.items()
        for other, b in theirs.items()
        if one != "foot"
    )


def test_a_clear_motion_keeps_off_a_standing_arm_anywhere_within_its_tolerance() -> None:
    chance = Random(4)  # noqa: S311 - nothing here is secret
    tolerance = (0.02,) * 7
    both = with_standing_arm(PANDA_BODY, PANDA_BODY, BESIDE, READY, tolerance)
    seen = {"apart": 0, "not apart": 0}
    for _ in range(12):
        end = tuple(
            min(max(q + chance.uniform(-0.7, 0.7), low + 0.05), high - 0.05)
            for q, low, high in zip(READY, Q_MIN, Q_MAX, strict=True)
        )
        end = (chance.uniform(-0.3, 1.6), *end[1:])
        contact = find_link_contact(swept(both, READY, end), CLEARANCE)
        if contact is not None:
            seen["not apart"] += any(name.startswith("left_") for name in (contact.inner, contact.outer))
            continue
        seen["apart"] += 1
        for share in np.linspace(0.0, 1.0, 7).tolist():
            q = tuple(x + share * (y - x) for x, y in zip(READY, end, strict=True))
            other = tuple(x + chance.uniform(-0.02, 0.02) for x in READY)
            assert arms_are_apart(corners_at(PANDA_BODY, q), corners_at(PANDA_BODY, other, (0.0, 0.45, 0.0)))
    assert min(seen.values()) >= 2


def test_an_arm_that_turns_into_the_other_is_found_and_alone_it_is_free() -> None:
    reaching = (0.0, 0.6, 0.0, -1.6, 0.0, 2.2, 0.8)
    turned = (1.6, *reaching[1:])
    assert find_link_contact(swept(PANDA_BODY, reaching, turned), CLEARANCE) is None
    both = with_standing_arm(PANDA_BODY, PANDA_BODY, BESIDE, READY, STILL)
    contact = find_link_contact(swept(both, reaching, turned), CLEARANCE)
    assert contact is not None
    assert contact.inner.startswith("left_")


ONE = RobotBody(
    ((0.0, 0.0, 0.0),),
    (0.5, 0.0, 0.0),
    (Ball("arm", 1, (0.5, 0.0, 0.0), 0.1),),
    (Hull("arm", 1, ((0.0, 0.0, 0.0), (0.5, 0.0, 0.0)), 0.1),),
)
"""A bar of half a metre that turns about z."""


def test_the_tolerance_of_the_standing_arm_enlarges_it_by_as_much_as_it_may_move() -> None:
    carried = ArmMount("left_", (0.0, 0.0, 0.2), (0.0, 0.0, pi / 2.0), 1)
    both = with_standing_arm(ONE, ONE, carried, (0.0,), (0.1,))
    _, ball = both.balls
    assert (ball.link, ball.joint) == ("left_arm", 1)
    assert ball.radius == pytest.approx(0.15)
    assert ball.centre == pytest.approx((0.0, 0.5, 0.2))
    assert both.hulls[1].radius == pytest.approx(0.15)
    assert both.dh_rows == ONE.dh_rows


MIXED = RobotBody(
    ((0.0, 0.0, 0.2), (0.0, 1.2, 0.1, 0.3, PRISMATIC), (0.3, -0.7, 0.1), (0.2, 0.9, 0.0)),
    (0.1, 0.0, 0.2),
    (Ball("tip", 4, (0.3, 0.1, 0.2), 0.05), Ball("middle", 2, (0.1, 0.2, 0.0), 0.05)),
    (Hull("tip", 4, ((0.3, 0.1, 0.2), (0.0, 0.4, 0.0)), 0.02), Hull("middle", 2, ((0.1, 0.2, 0.0),), 0.02)),
)
"""An arm with a prismatic joint, of points."""


def test_no_joint_within_its_tolerance_takes_a_point_out_of_its_enclosure() -> None:
    chance, tolerance = Random(2), (0.05, 0.02, 0.0, 0.04)  # noqa: S311 - nothing here is secret
    mount = ArmMount("left_", (0.3, -0.2, 0.1), (0.4, -0.9, 2.0))
    mountings, places = [mounting_of(row) for row in MIXED.dh_rows], mount.frame
    nearest = inf
    for _ in range(20):
        posture = tuple(chance.uniform(-1.0, 1.0) for _ in range(4))
        both = with_standing_arm(ONE, MIXED, mount, posture, tolerance)
        for _ in range(50):
            # The ends of the ranges, too.
            off = [chance.choice((-room, room, chance.uniform(-room, room))) for room in tolerance]
            frames = frames_of(mountings, [q + d for q, d in zip(posture, off, strict=True)])
            for hull, carried in zip(MIXED.hulls, both.hulls[1:], strict=True):
                for corner, centre in zip(hull.corners, carried.corners, strict=True):
                    moved = dist(places.to_base(frames[hull.joint].to_base(corner)), centre)
                    assert moved <= carried.radius - hull.radius + 1e-12
                    nearest = min(nearest, carried.radius - hull.radius - moved)
    assert nearest < 0.01
    still = with_standing_arm(ONE, MIXED, mount, (0.0,) * 4, (0.0,) * 4)
    assert [hull.radius for hull in still.hulls[1:]] == [0.02, 0.02]


def test_the_place_of_an_arm_is_that_of_urdf() -> None:
    angles = (0.4, -0.9, 2.0)
    frame = ArmMount("left_", (1.0, 2.0, 3.0), angles).frame
    pose = Pose((1.0, 2.0, 3.0), roll_pitch_yaw(*angles))
    for point in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.2, -0.5, 1.0)):
        assert frame.to_base(point) == pytest.approx(to_world(pose, point))


def test_a_barrier_is_kept_off_by_the_standing_arm_too() -> None:
    both = with_standing_arm(ONE, ONE, BESIDE, (0.0,), (0.0,))
    wall = BarrierBox("wall", (0.4, 0.55, -1.0), (1.0, 1.0, 1.0), False, False, None)
    breach = find_breach(swept(both, (0.0,), (-0.1,))._replace(joint_tolerance=(0.0,)), [wall], 0.0)
    assert breach is not None
    assert breach.link == "left_arm"


AT_BASE = ArmMount("left_", (0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("mount", "posture", "tolerance", "message"),
    [
        (AT_BASE._replace(prefix=""), (0.0,), (0.0,), "both arms have a link `arm`"),
        (AT_BASE, (), (0.0,), "1 finite positions are needed"),
        (AT_BASE, (nan,), (0.0,), "1 finite positions are needed"),
        (AT_BASE, (0.0,), (), "1 finite tolerances are needed"),
        (AT_BASE, (0.0,), (nan,), "1 finite tolerances are needed"),
        (AT_BASE, (0.0,), (-0.1,), "a tolerance of -0.1 is below 0"),
        (AT_BASE._replace(joint=2), (0.0,), (0.0,), "no 2 joints carry the arm: the moving arm has 1"),
        (AT_BASE._replace(joint=-1), (0.0,), (0.0,), "no -1 joints carry the arm"),
        (AT_BASE._replace(at=(0.0, inf, 0.0)), (0.0,), (0.0,), "the place of the arm is not finite"),
        (AT_BASE._replace(roll_pitch_yaw=(nan, 0.0, 0.0)), (0.0,), (0.0,), "the place of the arm is not"),
    ],
)
def test_numbers_that_would_make_the_standing_arm_too_small_or_misplace_it_are_refused(
    mount: ArmMount, posture: JointVector, tolerance: JointVector, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        with_standing_arm(ONE, ONE, mount, posture, tolerance)


def test_a_link_of_one_kind_of_volume_alone_is_a_link_too() -> None:
    for other in (replace(ONE, balls=()), replace(ONE, hulls=())):
        with pytest.raises(ValueError, match="both arms have a link `arm`; choose another prefix"):
            with_standing_arm(ONE, other, AT_BASE._replace(prefix=""), (0.0,), (0.0,))
