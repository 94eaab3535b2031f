"""Motions under way at once become one motion of joints and base, or the reason why not."""

from __future__ import annotations

from dataclasses import replace
from math import inf, nan
from typing import Any

import pytest

from aeros.runtime.gate.joint_rules import ActiveAction
from aeros.runtime.motion.merged import (
    ConcurrentMotion,
    commanded_joint_position,
    concurrent_motions,
    merge_motions,
    moves_base,
)
from aeros.runtime.motion.swept_volume import MergedMotion, RemainingMotion, moves_joints
from aeros.runtime.ports import MotionCompletion, NoMotion, RobotBody, ServoBounds, Trajectory
from aeros.skill import act

BODY = RobotBody(((0.0, 0.0, 0.0),), (0.5, 0.0, 0.25), ())
STAND = Trajectory(BODY, ((((0.0,),) * 4,),), (1.0, 0.0, 0.0), (0.0, 0.0, 0.0), 4.0)
TURN = replace(STAND, joint_paths=((((0.0,), (0.5,), (1.0,), (1.5,)),),), base=(2.0, 0.0, 0.0))
DRIVE = replace(STAND, base_path=(0.0, 4.0, -2.0))
SERVO = ServoBounds((0.25,), (1.0,), (1.0,), (1.0,), 0.1, 0.1, 0.1)
MARGIN = 1e-9


def under_way(plan: Trajectory, elapsed: float = 0.0, *, is_halting: bool = False) -> ConcurrentMotion:
    return ConcurrentMotion(act("roll"), plan, elapsed, is_halting)


def merged(plan: Trajectory, *others: ConcurrentMotion) -> MergedMotion:
    found = merge_motions(plan, others)
    assert isinstance(found, MergedMotion), found
    return found


def test_a_motion_moves_joints_base_both_or_nothing() -> None:
    both = replace(TURN, base_path=(0.0, 0.0, 0.1))
    found = [(moves_joints(one), moves_base(one)) for one in (STAND, TURN, DRIVE, both)]
    assert found == [(False, False), (True, False), (False, True), (True, True)]
    assert moves_joints(replace(STAND, servo=SERVO))
    there_and_back = replace(STAND, joint_paths=((((0.0,), (0.5,), (0.5,), (0.0,)),),))
    assert moves_joints(there_and_back)


def test_only_actions_with_a_trajectory_move_the_body() -> None:
    roll, wait = act("roll"), act("wait")
    active = [
        (ActiveAction(roll, {}, 1.0, 7), TURN, True),
        (ActiveAction(wait, {}, 1.0, 8), NoMotion("it waits"), False),
        (ActiveAction(wait, {}, 1.0, 8), None, False),
        (ActiveAction(wait, {}, 1.0, 8), MotionCompletion(False, "unreachable"), False),
        (ActiveAction(wait, {}, 0.5, 9), DRIVE, False),
    ]
    assert concurrent_motions(active, 3.5) == [
        ConcurrentMotion(roll, TURN, 2.5, True),
        ConcurrentMotion(wait, DRIVE, 3.0, False),
    ]


def test_a_motion_alone_is_both() -> None:
    found = merged(TURN)
    assert found == MergedMotion(RemainingMotion(TURN), RemainingMotion(TURN))
    assert found.is_single_motion


def test_arm_and_base_take_a_motion_each() -> None:
    found = merged(TURN, under_way(DRIVE))
    assert (found.joints.motion, found.base.motion) == (TURN, DRIVE)
    assert not found.is_single_motion
    other = merged(DRIVE, under_way(STAND), under_way(TURN))
    assert (other.joints.motion, other.base.motion) == (TURN, DRIVE)


def test_an_action_without_motion_yields_to_one_with_motion() -> None:
    found = merged(STAND, under_way(TURN, 2.0))
    assert (found.joints.motion, found.base.motion) == (TURN, STAND)
    assert found.joints.s == pytest.approx(0.5)
    assert found.base.s == 0.0
    assert merged(STAND, under_way(replace(STAND, duration=1.0))).joints.motion is STAND


@pytest.mark.parametrize(
    ("plan", "other", "why"),
    [
        (TURN, under_way(DRIVE, is_halting=True), "the `roll` under way is coming to rest"),
        (replace(TURN, servo=SERVO), under_way(DRIVE), "feedback on a moving base cannot be bounded"),
        (DRIVE, under_way(replace(TURN, servo=SERVO)), "during the `roll` under way: feedback"),
        (TURN, under_way(replace(DRIVE, body=replace(BODY, tool_offset=(0.0, 0.0, 0.0)))), "another body"),
        (TURN, under_way(TURN), "would move the same part of the robot"),
        (DRIVE, under_way(DRIVE), "would move the same part of the robot"),
    ],
)
def test_motions_that_cannot_be_merged_say_why(plan: Trajectory, other: ConcurrentMotion, why: str) -> None:
    found = merge_motions(plan, [under_way(STAND), other])
    assert isinstance(found, str)
    assert why in found


@pytest.mark.parametrize(
    ("elapsed", "s"),
    [
        (-1.0, 0.0),
        (0.0, 0.0),
        (nan, 0.0),
        (1.0, 0.103515625 - MARGIN),  # u = 1/4: 10/64 - 15/256 + 6/1024
        (2.0, 0.5 - MARGIN),
        (3.0, 0.896484375 - MARGIN),
        (4.0, 1.0 - MARGIN),
        (9.0, 1.0 - MARGIN),
        (inf, 1.0 - MARGIN),
        (1e-6, 0.0),
    ],
)
def test_progress_is_never_more_than_the_motion_has_made(elapsed: float, s: float) -> None:
    found = merged(STAND, under_way(DRIVE, elapsed)).base.s
    assert found == pytest.approx(s, abs=1e-15)
    assert found <= max(0.0, s + 1e-15)


def test_a_motion_under_way_is_at_its_own_place_of_the_path() -> None:
    assert commanded_joint_position(under_way(TURN, 0.0)) == (0.0,)
    assert commanded_joint_position(under_way(TURN, 2.0)) == pytest.approx((0.75,))
    assert commanded_joint_position(under_way(TURN, 5.0)) == pytest.approx((1.5,))


def test_the_end_is_that_of_both_motions() -> None:
    found = merged(TURN, under_way(DRIVE, 2.0))
    assert found.base_at_end() == (1.0, 4.0, -2.0)
    # 1.5 rad: (0.5·cos 1.5, 0.5·sin 1.5, 0.25) from the base.
    assert found.tool_at_end() == pytest.approx((1.035368600834, 4.498747493302, -1.75))


def test_the_rest_of_both_motions_is_swept() -> None:
    swept = merged(TURN, under_way(DRIVE, 2.0)).swept_motion()
    assert swept.body is BODY
    assert swept.paths == ([TURN.joint_paths[0][0]],)
    assert swept.joint_tolerance == (0.0,)
    assert swept.base == pytest.approx((1.0, 2.0, -1.0))
    assert swept.base_path == pytest.approx((0.0, 2.0, -1.0))
    assert not swept.is_synchronous


def test_the_completed_part_of_the_arms_motion_is_not_swept() -> None:
    swept = merged(DRIVE, under_way(TURN, 2.0)).swept_motion()
    assert [[q for (q,) in piece] for (piece,) in swept.paths] == [pytest.approx([0.75, 1.0, 1.25, 1.5])]
    assert (swept.base, swept.base_path) == ((1.0, 0.0, 0.0), (0.0, 4.0, -2.0))


def test_a_single_motion_keeps_joints_and_base_together() -> None:
    both: Any = replace(TURN, base_path=(0.0, 1.0, 0.0))
    assert merged(both).swept_motion().is_synchronous


def test_under_feedback_every_path_and_the_tolerance_are_swept() -> None:
    servo = replace(TURN, joint_paths=TURN.joint_paths * 2, servo=SERVO)
    swept = merged(servo).swept_motion()
    assert len(swept.paths) == 2
    assert swept.joint_tolerance == (0.25,)
