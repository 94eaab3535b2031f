"""Reasons against motions in full: each names the part at fault, with numbers and units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from math import cos, nan, sin
from typing import Any, cast

import pytest

from aeros.runtime.gate.decision import Decision, DecisionKind
from aeros.runtime.motion.link_distance import find_link_contact
from aeros.runtime.motion.merged import ConcurrentMotion
from aeros.runtime.motion.swept_volume import MergedMotion, RemainingMotion
from aeros.runtime.motion.trajectory import MotionDecider, held_object
from aeros.runtime.ports import Ball, Obstacle, Reading
from aeros.skill import act
from aeros.spec.expr.scope import AxisAlignedBox
from aeros.spec.model.motion import HeldObject, MotionPolicy, ObstaclePolicy, ToolLimits, Tracking
from tests.unit.runtime.motion.test_trajectory import (
    APART,
    BODY,
    CARRYING,
    DRIVING,
    FOLDING,
    NOWHERE,
    POLICY,
    REACH,
    TENTH,
    TRACKED,
    barrier_text,
    driving,
    motion,
    servo,
)

AT_START = {"joint_angle": Reading((0.0,), 0.0)}


def texts(
    plan: Any,
    kind: str = "move",
    policy: MotionPolicy = POLICY,
    readings: Mapping[str, Reading] = AT_START,
    others: Sequence[ConcurrentMotion] = (),
    **more: Any,
) -> list[str]:
    target = (0.438791280945, 0.239712769302, 0.5)
    parameters = {"target": target, "x": 0.0, "y": 0.0, "speed": 0.25, **more}
    allowed = Decision(DecisionKind.ALLOW, act(kind, **parameters), ())
    found = MotionDecider(policy).decide(allowed, plan, dict(readings), others)
    assert all(reason.code.startswith("AE76") for reason in found.reasons)
    return [f"{reason.code[2:]} {reason.rule}: {reason.text}" for reason in found.reasons]


def bodied(**changed: Any) -> Any:
    return motion(body=replace(FOLDING, **changed))


ARM = FOLDING.hulls[0]


@pytest.mark.parametrize(
    ("plan", "fault"),
    [
        (motion(joint_paths=iter(())), "one of its parts is not of the type that it has to be, or no tuple"),
        (motion(joint_paths=()), "it does not have one path, or several under feedback"),
        (
            motion(joint_paths=motion().joint_paths * 2),
            "it does not have one path, or several under feedback",
        ),
        (motion(joint_paths=((((0.0,), (0.1,), (0.2,)),),)), "a segment does not have four control points"),
        (motion(joint_paths=((((0.0, 0.0),) * 4,),)), "it does not have 1 joints"),
        (motion(duration=nan), "one of its numbers is not finite"),
        (motion(duration=2), "one of its numbers, 2, is of the type `int`; it needs `float`"),
        (bodied(tool_offset=(0, 0.0, 0.0)), "one of its numbers, 0, is of the type `int`; it needs `float`"),
        (motion(duration=0.0), "its duration is not above 0 s"),
        (motion(base_path=(1.0, 0.0, 0.0), servo=servo()), "the base travels under feedback"),
        (
            bodied(balls=(Ball("arm", 2, NOWHERE, 0.1),)),
            "a sphere of the body moves with no joint, or has no radius",
        ),
        (
            motion(joint_paths=(motion(0.2).joint_paths[0] * 2,)),
            "its segments do not join smoothly, so its jerk has no bound",
        ),
        (bodied(balls=(Ball("leg", 1, NOWHERE, 0.1),)), "the body has no link `arm`"),
        (bodied(balls=()), "the body has no link `arm`"),
        (motion(base_path=(0.0, 0.0)), "a point does not have three coordinates"),
        (bodied(dh_rows=((0.0,) * 6,)), "a joint does not have three to five parameters"),
        (bodied(dh_rows=((0.0,) * 5,)), "the fifth parameter of a joint is not that of a prismatic one"),
        (motion(servo=servo(speed=())), "its feedback does not have 1 joints"),
        (bodied(hulls=()), "the body has no hull of its link `arm`, so distances between links are unknown"),
        (
            bodied(hulls=(ARM._replace(joint=2),)),
            "the hull of `arm` moves with no joint, has no corner or no radius",
        ),
        (
            bodied(hulls=(ARM._replace(corners=(cast("Any", (0.0, 0.0)),)),)),
            "a corner of the hull of `arm` does not have three coordinates",
        ),
        (bodied(hulls=(ARM._replace(joint=0),)), "the hull of `arm` does not move with its spheres"),
        (
            bodied(exempt_pairs=(("arm", "leg"),)),
            "a pair of links that needs no check is not two of the links",
        ),
        (motion(body=None), "one of its parts is not of the type that it has to be, or no tuple"),
        (motion(joint_paths=None), "'NoneType' object is not iterable"),
    ],
)
def test_the_fault_of_a_malformed_motion_in_full(plan: Any, fault: str) -> None:
    assert texts(plan, policy=APART) == [f"760 move: the motion is malformed: {fault}"]
    under_way = ConcurrentMotion(act("drive", x=0.0, y=0.0, speed=0.25), plan, 0.0)
    assert texts(motion(body=FOLDING), policy=APART, others=[under_way]) == [
        f"764 move: the `drive` under way is malformed: {fault}"
    ]


def test_a_body_needs_a_link_even_if_no_barrier_names_one() -> None:
    policy = replace(POLICY, barriers=())
    expected = ["760 move: the motion is malformed: the body has no link ``"]
    assert texts(bodied(balls=()), policy=policy) == expected


def tool_limits(*rates: Fraction) -> ToolLimits:
    return ToolLimits((rates[0],) * 3, (rates[0],) * 3)


@pytest.mark.parametrize(
    ("plan", "given", "expected"),
    [
        (None, {}, ["760 move: the plant did not return the motion that it would make"]),
        (
            motion(),
            {"readings": {"joint_angle": Reading((0.02,), 0.0)}},
            ["761 joint_angle: the motion starts 0.02 rad from the measured position of a joint"],
        ),
        (motion(), {"readings": {}}, ["761 joint_angle: the joint positions are not known"]),
        (motion(0.49), {}, ["761 target: the motion ends 5 mm from the target of the tool"]),
        (
            motion(0.0, 4.0, base_path=(0.5, 0.0, 0.0)),
            {"kind": "drive", "x": 0.502},
            ["761 x: the motion ends 2 mm from the target of the base"],
        ),
        (
            motion(),
            {"kind": "turn", "angle": 0.51},
            ["761 angle: the motion ends 0.01 rad from the target of a joint"],
        ),
        (
            motion(),
            {"kind": "slide", "policy": TRACKED},
            ["761 base: the position of the base is not known"],
        ),
        (
            motion(),
            {
                "kind": "slide",
                "policy": TRACKED,
                "readings": {**AT_START, "base": Reading((0.0, 0.0, -0.011), 0.0)},
            },
            ["761 base: the motion has the base 11 mm from its measured position"],
        ),
        (
            motion(),
            {"policy": replace(POLICY, highest=(Fraction(49, 100),))},
            ["762 joint-1: joint 1 may be from 0 to 0.5 rad; its limits are -2 and 0.49 rad"],
        ),
        (
            motion(joint_paths=motion().joint_paths, servo=servo(joint_tolerance=(1.75,))),
            {"kind": "slide", "policy": replace(POLICY, barriers=())},
            ["762 joint-1: joint 1 may be from -1.75 to 2.25 rad; its limits are -2 and 2 rad"],
        ),
        (
            motion(joint_paths=motion().joint_paths, servo=servo(joint_tolerance=(0.125,))),
            {"kind": "slide", "policy": replace(POLICY, lowest=(Fraction(-1, 10),), barriers=())},
            ["762 joint-1: joint 1 may be from -0.125 to 0.625 rad; its limits are -0.1 and 2 rad"],
        ),
        (
            motion(),
            {
                "policy": replace(
                    POLICY, joint_limits=((Fraction(1, 10),), (Fraction(1, 10),), (Fraction(1),))
                )
            },
            [
                "762 joint-1-speed: the speed of joint 1 may reach 0.4688 rad/s; the limit is 0.1 rad/s",
                "762 joint-1-acceleration: the acceleration of joint 1 may reach 0.7217 rad/s²; "
                "the limit is 0.1 rad/s²",
                "762 joint-1-jerk: the jerk of joint 1 may reach 3.75 rad/s³; the limit is 1 rad/s³",
            ],
        ),
        (
            motion(),
            {"policy": replace(POLICY, tool_limits=tool_limits(Fraction(1, 10)))},
            [
                "762 tool-speed: the speed of the tool may reach 0.2344 m/s; the limit is 0.1 m/s",
                "762 tool-acceleration: the acceleration of the tool may reach 0.4716 m/s²; "
                "the limit is 0.1 m/s²",
                "762 tool-jerk: the jerk of the tool may reach 2.438 m/s³; the limit is 0.1 m/s³",
                "762 tool-turning-speed: the speed of the tool's rotation may reach 0.4706 rad/s; "
                "the limit is 0.1 rad/s",
                "762 tool-turning-acceleration: the acceleration of the tool's rotation may reach "
                "0.8344 rad/s²; the limit is 0.1 rad/s²",
                "762 tool-turning-jerk: the jerk of the tool's rotation may reach 4.427 rad/s³; "
                "the limit is 0.1 rad/s³",
            ],
        ),
        (motion(), {"speed": 0.2}, ["762 speed: the tool may reach 0.2344 m/s; 0.2 m/s was decided"]),
        (
            motion(0.0, 2.0, base_path=(0.9, 0.0, 0.0)),
            {
                "kind": "drive",
                "x": 0.9,
                "speed": 1.0,
                "policy": replace(POLICY, base_limits=(Fraction(1, 2), Fraction(9, 10))),
            },
            [
                "762 base-speed: the speed of the base may reach 0.8438 m/s; the limit is 0.5 m/s",
                "762 base-acceleration: the acceleration of the base may reach 1.299 m/s²; "
                "the limit is 0.9 m/s²",
            ],
        ),
        (
            motion(),
            {"others": [driving(is_halting=True)]},
            ["764 move: the `drive` under way is coming to rest, and its final position is not known yet"],
        ),
        (
            motion(),
            {"others": [ConcurrentMotion(REACH, motion(), 0.0)]},
            ["764 move: it and a motion under way would move the same part of the robot"],
        ),
        (
            motion(),
            {"others": [driving(plan=replace(DRIVING, body=replace(BODY, tool_offset=(0.4, 0.0, 0.5))))]},
            ["764 move: the `drive` under way is a motion of another body"],
        ),
        (
            motion(joint_paths=motion().joint_paths * 2, servo=servo()),
            {"others": [driving()]},
            ["764 move: during the `drive` under way: feedback on a moving base cannot be bounded"],
        ),
        (
            motion(),
            {
                "others": [ConcurrentMotion(act("drive", x=0.4, y=0.1, speed=0.1), DRIVING, 0.0)],
                "speed": 0.5,
                "target": (0.838791280945, 0.239712769302, 0.5),
            },
            [
                "761 x: the `drive` under way would end 100 mm from the target of the base",
                "762 speed: the base may reach 0.1875 m/s; 0.1 m/s was decided",
            ],
        ),
        (
            DRIVING,
            {
                "kind": "drive",
                "x": 0.5,
                "others": [ConcurrentMotion(REACH, motion(base=(0.4, 0.0, 0.0)), 1.0)],
            },
            [
                "761 x: the motion ends 100 mm from the target of the base",
                "761 joint_angle: the `move` under way is 0.25 rad from the measured position of a joint",
            ],
        ),
    ],
)
def test_the_reasons_against_a_motion_in_full(plan: Any, given: Any, expected: list[str]) -> None:
    assert texts(plan, **given) == expected


@pytest.mark.parametrize("angle", [1.04, 1.043, 1.047, 1.05, 1.052, 1.053])
def test_a_reason_has_the_distance_from_a_barrier_in_millimetres(angle: float) -> None:
    """At an angle a, the tip's ball of 60 mm is at y = 0.5 sin a; the pillar begins at y = 0.5 m."""
    left = 500.0 - 500.0 * sin(angle) - 60.0
    assert f"comes as near as {left:.3g} mm to the faces" in barrier_text(motion(angle, 8.0))
    entered = 500.0 * sin(0.5 + angle) + 60.0 - 500.0
    assert f"enters the volume `pillar` by {entered:.3g} mm at 100 %" in barrier_text(
        motion(0.5 + angle, 8.0)
    )


def test_distances_to_keep_are_in_millimetres_too() -> None:
    allowed = Decision(DecisionKind.ALLOW, act("slide", speed=0.5), ())
    eighth = Fraction(1, 128)  # 7.8125 mm
    near = MotionDecider(replace(POLICY, clearance=eighth)).decide(allowed, motion(1.05, 8.0), AT_START)
    assert "7.81 mm are needed" in near.reasons[0].text
    inside = MotionDecider(replace(POLICY, clearance=eighth)).decide(allowed, motion(1.5, 8.0), AT_START)
    assert "it has to keep 7.81 mm from its faces" in inside.reasons[0].text
    beside = replace(FOLDING, hulls=(ARM, FOLDING.hulls[1]._replace(corners=((0.4, 0.3, 0.5),))))
    folded = MotionDecider(replace(APART, link_clearance=eighth)).decide(
        allowed, motion(0.5, 8.0, body=beside), AT_START
    )
    assert folded.reasons[0].text.endswith("links keep 7.81 mm apart")
    obstacle = Obstacle("crate", (0.35, 0.15, 0.4), (0.45, 0.25, 0.6), 1.0, "overhead", "bench")
    seen = MotionDecider(replace(POLICY, clearance=eighth)).decide(
        allowed, motion(0.5, 8.0), AT_START, (), (obstacle,)
    )
    assert "may come nearer than 7.81 mm to crate" in seen.reasons[0].text


def test_the_space_of_what_is_held_is_around_the_tool() -> None:
    box = AxisAlignedBox(
        (Fraction(-1, 2), Fraction(0), Fraction(1, 8)), (Fraction(1), Fraction(2), Fraction(3))
    )
    space = held_object(replace(CARRYING, held=HeldObject("holding", box)), BODY, {})
    assert space is not None
    x, y, z = BODY.tool_offset
    assert {*space.corners} == {
        (x + a, y + b, z + c) for a in (-0.5, 1.0) for b in (0.0, 2.0) for c in (0.125, 3.0)
    }
    assert (space.link, space.joint, space.radius) == ("held", 1, 0.0)
    lower, upper = (Fraction(0),) * 3, cast("Any", (Fraction(1),) * 4)
    flat = replace(CARRYING, held=HeldObject("holding", AxisAlignedBox(lower, upper)))
    with pytest.raises(ValueError, match="zip"):
        held_object(flat, BODY, {})


def test_a_reason_has_the_distance_of_a_held_object_as_small_as_its_foot_leaves_it() -> None:
    """The foot is 80 mm beside the tool, so that of 100 mm that may be held on each side 50 mm are left."""
    beside = AxisAlignedBox(
        (Fraction(0), Fraction(-1), Fraction(0)), (Fraction(1), Fraction(-8, 100), Fraction(1))
    )
    own = replace(CARRYING.barriers[0], box=beside, is_in_base_frame=True, links=frozenset({"held"}))
    allowed = Decision(DecisionKind.ALLOW, act("slide", speed=0.5), ())
    readings = {**AT_START, "holding": Reading(True, 0.0)}
    decider = MotionDecider(replace(CARRYING, barriers=(own,)))
    (reason,) = decider.decide(allowed, motion(-0.1), readings).reasons
    # At -0.1 rad the corner (0.6, -0.05) is at y = 0.6 sin(-0.1) - 0.05 cos(-0.1).
    entered = -80.0 + 600.0 * sin(0.1) + 50.0 * cos(0.1)
    assert reason.text == (
        f"`held` enters the volume `pillar` by {entered:.3g} mm at 100 % of the path; "
        "it has to keep 10 mm from its faces: it holds the roof"
    )
    free = decider.decide(allowed, motion(0.1), readings)
    assert free.reasons == ()


@pytest.mark.parametrize(("way", "suffix"), [(0.75, ", and at its target"), (1.5, "")])
def test_a_reason_names_what_a_driving_base_meets_and_if_it_is_at_its_target(way: float, suffix: str) -> None:
    carriage = AxisAlignedBox(
        (Fraction(-1, 4), Fraction(-1, 4), Fraction(-1)), (Fraction(1, 4), Fraction(1, 4), Fraction(-1, 2))
    )
    policy = replace(POLICY, obstacles=ObstaclePolicy((), Fraction(0), Fraction(0), TENTH, carriage))
    crate = Obstacle("crate", (0.75, -0.1, -0.9), (0.8, 0.1, -0.6), 1.0, "overhead", "aisle")
    allowed = Decision(DecisionKind.ALLOW, act("drive", x=way, y=0.0, speed=0.5), ())
    plan = motion(0.0, 8.0, base_path=(way, 0.0, 0.0))
    (reason,) = MotionDecider(policy).decide(allowed, plan, AT_START, (), (crate,)).reasons
    # The base reaches to 0.25 m before its origin, and keeps 10 mm: it may come as far as 0.49 m.
    assert f"{reason.code} {reason.rule}: {reason.text}" == (
        "AE766 crate: `base` may come nearer than 10 mm to crate at (0.78, 0.00) m in aisle, "
        f"50 x 200 x 300 mm at {49.0 / way:.0f} % of the path{suffix}; `overhead` saw it"
    )
    assert MotionDecider(POLICY).decide(allowed, plan, AT_START, (), (crate,)) is allowed
    (other,) = MotionDecider(policy).decide(allowed, plan, AT_START, (), (far(crate), crate)).reasons
    assert other == reason


def far(obstacle: Obstacle) -> Obstacle:
    return obstacle._replace(name="far", lower=(0.0, 8.0, -0.9), upper=(0.1, 9.0, -0.6))


@pytest.mark.parametrize("y", [0.05, 0.1, 0.15, 0.2])
def test_a_reason_about_two_links_has_their_distance_and_place(y: float) -> None:
    body = replace(FOLDING, hulls=(ARM, FOLDING.hulls[1]._replace(corners=((0.4, y, 0.5),))))
    plan = motion(0.5, 8.0, body=body)
    part = RemainingMotion(plan)
    contact = find_link_contact(MergedMotion(part, part).swept_motion(), 0.005)
    assert contact is not None
    assert texts(plan, "slide", APART) == [
        f"765 post-arm: `arm` may come within {1000.0 * contact.distance:.3g} mm of `post` at "
        f"{100.0 * contact.path_parameter:.0f} % of the path; links keep 5 mm apart"
    ]


def test_a_base_may_be_measured_exactly_as_far_away_as_it_is_tracked() -> None:
    for bound, expected in (
        (Fraction(1, 128), []),
        (Fraction(1, 129), ["761 base: the motion has the base 7.81 mm from its measured position"]),
    ):
        policy = replace(TRACKED, tracking=Tracking("off", bound, (Fraction(1, 2),)))
        readings = {**AT_START, "base": Reading((0.0, 1 / 128, 0.0), 0.0)}
        assert texts(motion(), "slide", policy, readings) == expected


def test_an_obstacle_is_a_reason_beside_all_others() -> None:
    obstacle = Obstacle("crate", (0.35, 0.15, 0.4), (0.45, 0.25, 0.6), 1.0, "overhead", "bench")
    allowed = Decision(DecisionKind.ALLOW, act("slide", speed=0.1), ())
    readings = {"joint_angle": Reading((0.02,), 0.0)}
    found = MotionDecider(POLICY).decide(allowed, motion(), readings, (), (obstacle,))
    assert [reason.code for reason in found.reasons] == ["AE761", "AE762", "AE766"]
