"""Decisions about whole motions: each possible violation, and that nothing else objects."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from math import inf, nan, nextafter
from typing import Any, cast

import pytest

from aeros.kinematic_chain import PRISMATIC
from aeros.runtime.gate.decision import Decision, DecisionKind
from aeros.runtime.motion.kinematic_bounds import base_rates
from aeros.runtime.motion.merged import ConcurrentMotion
from aeros.runtime.motion.trajectory import MotionDecider
from aeros.runtime.ports import (
    Ball,
    Hull,
    MotionCompletion,
    NoMotion,
    Obstacle,
    Reading,
    RobotBody,
    ServoBounds,
    Trajectory,
    Vec3,
)
from aeros.skill import Action, act
from aeros.spec.expr.scope import AxisAlignedBox
from aeros.spec.model.motion import (
    Barrier,
    HeldObject,
    MotionKind,
    MotionPolicy,
    ToolLimits,
    TouchedSurface,
    Tracking,
)

NOWHERE = (0.0, 0.0, 0.0)
PILLAR = AxisAlignedBox((Fraction(0), Fraction(1, 2), Fraction(0)), (Fraction(1), Fraction(2), Fraction(1)))
POLICY = MotionPolicy(
    kinds={
        "move": MotionKind("target", None, "speed"),
        "slide": MotionKind(None, None, "speed"),
        "drive": MotionKind(None, ("x", "y"), "speed"),
        "turn": MotionKind(None, None, "speed", ("angle",)),
    },
    start_variable="joint_angle",
    start_tolerance=Fraction(1, 100),
    end_tolerance=Fraction(1, 1000),
    lowest=(Fraction(-2),),
    highest=(Fraction(2),),
    joint_limits=((Fraction(1),), (Fraction(5),), (Fraction(500),)),
    tool_limits=ToolLimits(
        (Fraction(1), Fraction(5), Fraction(500)), (Fraction(1), Fraction(5), Fraction(500))
    ),
    clearance=Fraction(1, 100),
    barriers=(
        Barrier("off-the-pillar", "pillar", PILLAR, False, False, frozenset({"arm"}), "it holds the roof"),
    ),
)
BODY = RobotBody(
    ((0.0, 0.0, 0.0),), (0.5, 0.0, 0.5), tuple(Ball("arm", 1, (x / 10, 0.0, 0.5), 0.06) for x in range(6))
)


def motion(angle: float = 0.5, duration: float = 2.0, **changed: Any) -> Trajectory:
    """The arm of one vertical joint turns from 0 to `angle`."""
    a, b, c, d = ((angle * third / 3.0,) for third in range(4))
    return replace(Trajectory(BODY, (((a, b, c, d),),), NOWHERE, NOWHERE, duration), **changed)


def decided(
    plan: Any,
    kind: str = "move",
    policy: MotionPolicy = POLICY,
    joint: float | tuple[float, ...] = 0.0,
    speed: float = 0.25,
    **more: Any,
) -> list[tuple[str, str]]:
    target = (0.438791280945, 0.239712769302, 0.5)
    parameters = {"target": target, "x": 0.0, "y": 0.0, "speed": speed, **more}
    allowed = Decision(DecisionKind.ALLOW, act(kind, **parameters), ())
    measured = joint if isinstance(joint, tuple) else (joint,)
    found = MotionDecider(policy).decide(allowed, plan, {"joint_angle": Reading(measured, 0.0)})
    assert (found.kind is DecisionKind.DENY) == bool(found.reasons)
    assert found == allowed or found.action is None
    return [(reason.code, reason.rule) for reason in found.reasons]


def test_an_acceptable_motion_stays_allowed() -> None:
    assert decided(motion()) == []


def test_denied_actions_and_kinds_without_motion_policy_are_unchanged() -> None:
    denied = Decision(DecisionKind.DENY, None, ())
    assert MotionDecider(POLICY).decide(denied, motion(), {}) is denied
    assert decided(None, "wait") == []
    assert MotionDecider(None).covers_kind("move") is False


def test_a_plant_that_moves_nothing_or_refuses_is_trusted() -> None:
    assert decided(NoMotion("no body")) == []
    assert decided(MotionCompletion(False, "unreachable")) == []


@pytest.mark.parametrize(
    "plan",
    [
        None,
        "a path",
        motion(duration=nan),
        motion(duration=inf),
        motion(duration=0.0),
        motion(duration=2),
        motion(angle=nan),
        motion(base=(0.0, nan, 0.0)),
        motion(base_path=(0.0, 0.0)),
        motion(joint_paths=()),
        motion(joint_paths=((),)),
        motion(joint_paths=None),
        motion(joint_paths=motion().joint_paths * 2),
        motion(joint_paths=(((0.0,), (0.0,), (0.0,), (0.0,)),)),
        motion(joint_paths=((((0.0,), (0.1,), (0.2,)),),)),
        motion(joint_paths=((((0.0, 0.0),) * 4,),)),
        # A jump of position, of slope, of bend.
        motion(joint_paths=(motion(0.2).joint_paths[0] * 2,)),
        motion(joint_paths=((((0.0,),) * 4, ((0.0,), (0.1,), (0.2,), (0.3,))),)),
        motion(joint_paths=((((0.0,),) * 4, ((0.0,), (0.0,), (0.1,), (0.3,))),)),
        motion(body=replace(BODY, dh_rows=BODY.dh_rows * 2)),
        motion(body=replace(BODY, tool_offset=cast("Vec3", (0.0, 0.0)))),
        motion(body=replace(BODY, balls=())),
        motion(body=replace(BODY, balls=(Ball("leg", 1, NOWHERE, 0.1),))),
        motion(body=replace(BODY, balls=(Ball("arm", 2, NOWHERE, 0.1),))),
        motion(body=replace(BODY, balls=(Ball("arm", 1, NOWHERE, -0.1),))),
        motion(body=replace(BODY, balls=(Ball("arm", 1, NOWHERE, nan),))),
        motion(body=replace(BODY, balls=(Ball("arm", cast("int", 0.5), NOWHERE, 0.1),))),
        motion(body=replace(BODY, balls=(tuple.__new__(Ball, ("arm", 1)),))),
        motion(body=replace(BODY, balls=cast("Any", (("arm", 1, NOWHERE, 0.1),)))),
        motion(body=replace(BODY, dh_rows=cast("Any", ((0.0,) * 5,)))),
        motion(body=replace(BODY, hulls=(Hull("arm", 2, (NOWHERE,), 0.1),))),
        motion(body=None),
        # Parts that may be another after the decision.
        motion(base=[0.0, 0.0, 0.0]),
        motion(joint_paths=[*motion().joint_paths]),
        motion(joint_paths=iter(motion().joint_paths)),
        motion(joint_paths=iter(motion().joint_paths), servo=ServoBounds(*((1.0,),) * 4, 0.1, 0.1, 0.1)),
        motion(servo=ServoBounds((), (1.0,), (1.0,), (1.0,), 0.1, 0.1, 0.1)),
        motion(servo=ServoBounds((nan,), (1.0,), (1.0,), (1.0,), 0.1, 0.1, 0.1)),
        motion(base_path=(1.0, 0.0, 0.0), servo=ServoBounds((0.1,), (1.0,), (1.0,), (1.0,), 0.1, 0.1, 0.1)),
    ],
)
def test_a_malformed_motion_is_denied(plan: Any) -> None:
    assert decided(plan) == [("AE760", "move")]


def test_a_motion_must_start_at_the_joints_and_end_at_the_target() -> None:
    assert decided(motion(), joint=0.02) == [("AE761", "joint_angle")]
    assert decided(motion(0.49)) == [("AE761", "target")]
    drive = motion(0.0, 4.0, base_path=(0.5, 0.0, 0.0))
    assert decided(drive, "drive", x=0.5) == []
    assert decided(drive, "drive", x=0.502) == [("AE761", "x")]


def test_joints_must_end_at_their_targets() -> None:
    assert decided(motion(), "turn", angle=0.5) == []
    assert decided(motion(), "turn", angle=0.50001) == [("AE761", "angle")]
    assert decided(motion(), "turn", angle=nan) == [("AE761", "angle")]


def test_unmeasured_joints_are_denied() -> None:
    allowed = Decision(DecisionKind.ALLOW, act("slide", speed=0.25), ())
    found = MotionDecider(POLICY).decide(allowed, motion(), {})
    assert [(reason.code, reason.rule) for reason in found.reasons] == [("AE761", "joint_angle")]


@pytest.mark.parametrize(
    ("changed", "rules"),
    [
        # 0.5 rad in T: 0.9375/T, 2.887/T², 30/T³; the tool, 0.5 m out, half of each.
        ({"highest": (Fraction(49, 100),)}, ["joint-1"]),
        ({"lowest": (Fraction(1, 100),)}, ["joint-1"]),
        ({"joint_limits": ((Fraction(46, 100),), (Fraction(5),), (Fraction(500),))}, ["joint-1-speed"]),
        (
            {"joint_limits": ((Fraction(1),), (Fraction(72, 100),), (Fraction(500),))},
            ["joint-1-acceleration"],
        ),
        ({"joint_limits": ((Fraction(1),), (Fraction(5),), (Fraction(3),))}, ["joint-1-jerk"]),
        (
            {
                "tool_limits": ToolLimits(
                    (Fraction(23, 100), Fraction(5), Fraction(500)), (Fraction(1), Fraction(5), Fraction(500))
                )
            },
            ["tool-speed"],
        ),
        (
            {
                "tool_limits": ToolLimits(
                    (Fraction(1), Fraction(36, 100), Fraction(500)), (Fraction(1), Fraction(5), Fraction(500))
                )
            },
            ["tool-acceleration"],
        ),
        (
            {
                "tool_limits": ToolLimits(
                    (Fraction(1), Fraction(5), Fraction(1)), (Fraction(1), Fraction(5), Fraction(500))
                )
            },
            ["tool-jerk"],
        ),
        (
            {
                "tool_limits": ToolLimits(
                    (Fraction(1), Fraction(5), Fraction(500)), (Fraction(46, 100), Fraction(5), Fraction(500))
                )
            },
            ["tool-turning-speed"],
        ),
        (
            {
                "tool_limits": ToolLimits(
                    (Fraction(1), Fraction(5), Fraction(500)), (Fraction(1), Fraction(72, 100), Fraction(500))
                )
            },
            ["tool-turning-acceleration"],
        ),
        (
            {
                "tool_limits": ToolLimits(
                    (Fraction(1), Fraction(5), Fraction(500)), (Fraction(1), Fraction(5), Fraction(3))
                )
            },
            ["tool-turning-jerk"],
        ),
    ],
)
def test_each_limit_is_kept(changed: dict[str, Any], rules: list[str]) -> None:
    assert decided(motion(), policy=replace(POLICY, **changed)) == [("AE762", rule) for rule in rules]


def test_the_tool_must_keep_to_the_decided_speed() -> None:
    # The peak is 0.234375 m/s.
    assert decided(motion(), speed=0.2345) == []
    assert decided(motion(), speed=0.2343) == [("AE762", "speed")]
    assert decided(motion(0.0, 4.0, base_path=(0.5, 0.0, 0.0)), "drive", x=0.5, speed=0.234) == [
        ("AE762", "speed")
    ]


def test_no_link_may_meet_a_barrier() -> None:
    assert decided(motion(1.5, 8.0), "slide") == [("AE763", "off-the-pillar")]
    away = replace(POLICY, barriers=(replace(POLICY.barriers[0], is_in_base_frame=True),))
    beside = motion(1.5, 8.0, base=(0.0, -1.0, 0.0))
    assert decided(beside, "slide") == []
    assert decided(beside, "slide", policy=away) == [("AE763", "off-the-pillar")]


def barrier_text(plan: Trajectory, **barrier: Any) -> str:
    policy = replace(POLICY, barriers=(replace(POLICY.barriers[0], **barrier),))
    allowed = Decision(DecisionKind.ALLOW, act("slide", speed=0.5), ())
    found = MotionDecider(policy).decide(allowed, plan, {"joint_angle": Reading((0.0,), 0.0)})
    assert [reason.code for reason in found.reasons] == ["AE763"]
    return found.reasons[0].text


def test_a_breach_says_by_how_many_millimetres() -> None:
    """At an angle a, the tip's ball of 60 mm is at y = 0.5 sin a; the pillar begins at y = 0.5 m."""
    volume, kept = "the volume `pillar`", "it has to keep 10 mm from its faces: it holds the roof"
    assert barrier_text(motion(1.5, 8.0)) == f"`arm` enters {volume} by 58.7 mm at 100 % of the path; {kept}"
    near = f"`arm` comes as near as 6.29 mm to the faces of {volume} at 100 % of the path; 10 mm are needed"
    assert barrier_text(motion(1.05, 8.0)).startswith(near)
    left = f"`arm` leaves {volume} by 560 mm at 0 % of the path; {kept}"
    assert barrier_text(motion(0.1), keep_inside=True) == left
    assert barrier_text(motion(1.0351, 8.0)).startswith("`arm` may come nearer than 10 mm to the faces")


FOLDING = replace(
    BODY,
    hulls=(
        Hull("arm", 1, ((0.0, 0.0, 0.5), (0.5, 0.0, 0.5)), 0.06),
        Hull("post", 0, ((0.4, 0.1, 0.5),), 0.02),
    ),
)
"""With a post of its own beside the arm, which the arm meets after a quarter of a radian."""
APART = replace(POLICY, link_clearance=Fraction(1, 200))


def test_links_must_keep_apart_where_the_site_says_so() -> None:
    assert decided(motion(body=FOLDING)) == []
    assert decided(motion(body=FOLDING), policy=APART) == [("AE765", "post-arm")]
    assert decided(motion(-0.5, body=FOLDING), "slide", policy=APART) == []
    exempt = replace(FOLDING, exempt_pairs=(("arm", "post"),))
    assert decided(motion(body=exempt), policy=APART) == []


def test_the_reason_names_both_links_distance_and_place() -> None:
    allowed = Decision(DecisionKind.ALLOW, act("slide", speed=0.25), ())
    found = MotionDecider(APART).decide(allowed, motion(body=FOLDING), {"joint_angle": Reading((0.0,), 0.0)})
    assert [reason.text for reason in found.reasons] == [
        "`arm` may come within 0 mm of `post` at 50 % of the path; links keep 5 mm apart"
    ]


def test_a_motion_of_the_base_alone_does_not_bring_links_together() -> None:
    near = replace(FOLDING, hulls=(FOLDING.hulls[0], Hull("post", 0, ((0.4, 0.0, 0.5),), 0.02)))
    drive = motion(0.0, 4.0, body=near, base_path=(0.5, 0.0, 0.0))
    assert decided(drive, "drive", APART, x=0.5) == []


@pytest.mark.parametrize(
    "changed",
    [
        {"hulls": ()},
        {"hulls": FOLDING.hulls[1:]},
        {"hulls": [*FOLDING.hulls]},
        {"hulls": (FOLDING.hulls[0]._replace(joint=2),)},
        {"hulls": (FOLDING.hulls[0]._replace(joint=0),)},
        {"hulls": (FOLDING.hulls[0]._replace(joint=cast("int", 1.0)),)},
        {"hulls": (FOLDING.hulls[0]._replace(corners=()),)},
        {"hulls": (FOLDING.hulls[0]._replace(corners=(cast("Vec3", (0.0, 0.0)),)),)},
        {"hulls": (FOLDING.hulls[0]._replace(corners=((0.0, 0.0, nan),)),)},
        {"hulls": (FOLDING.hulls[0]._replace(radius=-0.1),)},
        {"hulls": (FOLDING.hulls[0]._replace(radius=inf),)},
        {"exempt_pairs": (("arm", "leg"),)},
        {"exempt_pairs": (("arm", "post", "arm"),)},
        {"exempt_pairs": None},
    ],
)
def test_links_that_cannot_be_compared_are_denied(changed: dict[str, Any]) -> None:
    unknown = replace(FOLDING, **changed)
    assert decided(motion(-0.5, body=unknown), "slide", policy=APART) == [("AE760", "slide")]


# What is held: a box of 0.2 m around the tool, which ends 0.11 m from the pillar.

TENTH = (Fraction(1, 10),) * 3
CARRYING = replace(
    POLICY,
    held=HeldObject("holding", AxisAlignedBox((Fraction(-1, 10),) * 3, TENTH)),
    barriers=(replace(POLICY.barriers[0], links=frozenset({"arm", "held"})),),
)
TURNED = motion(0.9, 4.0)
SURFACE = TouchedSurface(frozenset({"pillar"}), Fraction(1, 5), Fraction(1, 5))


def carried(
    held: Any, plan: Trajectory = TURNED, policy: MotionPolicy = CARRYING, kind: str = "slide"
) -> list[tuple[str, str]]:
    """Decide a motion while `holding` is measured so; it is not measured if None."""
    readings = {"joint_angle": Reading(plan.joint_paths[0][0][0], 0.0)}
    if held is not None:
        readings["holding"] = Reading(held, 0.0)
    allowed = Decision(DecisionKind.ALLOW, act(kind, speed=0.5), ())
    found = MotionDecider(policy).decide(allowed, plan, readings)
    return [(reason.code, reason.rule) for reason in found.reasons]


def test_a_held_object_keeps_clear_of_barriers_and_an_empty_hand_adds_nothing() -> None:
    assert carried(False) == []
    assert carried(True) == [("AE763", "off-the-pillar")]
    assert carried(True, motion(0.5)) == []


@pytest.mark.parametrize("held", [None, 0, 0.0, "false", nan])
def test_something_is_held_unless_it_is_measured_that_nothing_is(held: Any) -> None:
    assert carried(held) == [("AE763", "off-the-pillar")]


def test_a_barrier_applies_to_what_is_held_by_its_name_or_if_it_names_no_links() -> None:
    for links, found in ((frozenset({"arm"}), []), (None, [("AE763", "off-the-pillar")])):
        policy = replace(CARRYING, barriers=(replace(CARRYING.barriers[0], links=links),))
        assert carried(True, policy=policy) == found


def test_a_held_object_beside_a_volume_of_the_base_is_smaller_and_links_are_not() -> None:
    # The arm turns away; where it starts, the largest object would be 20 mm inside of what it stands on.
    beside = AxisAlignedBox(
        (Fraction(0), Fraction(-1), Fraction(0)), (Fraction(1), Fraction(-8, 100), Fraction(1))
    )
    own = replace(CARRYING.barriers[0], box=beside, is_in_base_frame=True)
    for barrier, plan, found in (
        (own, TURNED, []),
        (replace(own, links=None), TURNED, []),
        (own, motion(-0.5), [("AE763", "off-the-pillar")]),
        (replace(own, is_in_base_frame=False), TURNED, [("AE763", "off-the-pillar")]),
    ):
        assert carried(True, plan, replace(CARRYING, barriers=(barrier,))) == found


def test_a_site_without_space_for_held_objects_does_not_check_them() -> None:
    assert carried(True, policy=replace(CARRYING, held=None)) == []


def turn(start: float, end: float, duration: float) -> Trajectory:
    """The arm turns from `start` to `end` on a path of 16 pieces."""
    corners = [(start + (end - start) * step / 48.0,) for step in range(49)]
    path = tuple((corners[n], corners[n + 1], corners[n + 2], corners[n + 3]) for n in range(0, 48, 3))
    return replace(motion(), joint_paths=(path,), duration=duration)


@pytest.mark.parametrize(
    ("plan", "surface", "is_allowed"),
    [
        (turn(0.0, 0.9, 4.0), SURFACE, True),
        (turn(0.0, 0.9, 2.0), SURFACE, False),  # too fast where it enters
        (turn(0.0, 0.9, 4.0), replace(SURFACE, distance=Fraction(1, 20)), False),  # too far from its target
        (turn(0.0, 0.9, 4.0), replace(SURFACE, distance=None), False),  # for force control alone
        (turn(0.0, 0.9, 4.0), replace(SURFACE, volumes=frozenset({"table"})), False),
        (turn(0.9, 0.0, 2.0), SURFACE, True),  # it leaves
        (turn(0.9, 0.0, 2.0), replace(SURFACE, distance=Fraction(1, 20)), False),
        (turn(0.9, 0.8, 1.0), SURFACE, True),  # it stays inside, slowly
        (turn(0.9, 0.8, 0.4), SURFACE, False),
    ],
)
def test_a_held_object_touches_a_surface_only_near_start_and_target_and_slowly(
    plan: Trajectory, surface: TouchedSurface, is_allowed: bool
) -> None:
    kinds = {**CARRYING.kinds, "slide": replace(CARRYING.kinds["slide"], surface=surface)}
    policy = replace(CARRYING, kinds=kinds)
    assert carried(False, plan, policy) == []
    assert carried(True, plan, policy) == ([] if is_allowed else [("AE763", "off-the-pillar")])


def test_the_reason_names_where_and_how_fast_a_held_object_would_touch() -> None:
    kinds = {**CARRYING.kinds, "slide": replace(CARRYING.kinds["slide"], surface=SURFACE)}
    allowed = Decision(DecisionKind.ALLOW, act("slide", speed=0.5), ())
    readings = {"joint_angle": Reading((0.0,), 0.0), "holding": Reading(True, 0.0)}
    found = MotionDecider(replace(CARRYING, kinds=kinds)).decide(allowed, turn(0.0, 0.9, 2.0), readings)
    (reason,) = found.reasons
    assert reason.text.startswith("`held` may enter the volume `pillar` at 84 % of the path, 84.5 mm from")
    assert reason.text.endswith(" m/s; allowed are 200 mm and 0.2 m/s: it holds the roof")


TRACKED = replace(POLICY, base_variable="base", tracking=Tracking("off", Fraction(1, 100), (Fraction(1, 2),)))


@pytest.mark.parametrize(
    ("base", "found"),
    [((0.009, 0.0, 0.0), []), ((0.0, 0.0, -0.011), [("AE761", "base")]), (None, [("AE761", "base")])],
)
def test_a_motion_starts_where_the_base_is_measured(base: Vec3 | None, found: list[tuple[str, str]]) -> None:
    readings = {"joint_angle": Reading((0.0,), 0.0)}
    if base is not None:
        readings["base"] = Reading(base, 0.0)
    allowed = Decision(DecisionKind.ALLOW, act("slide", speed=0.25), ())
    decision = MotionDecider(TRACKED).decide(allowed, motion(), readings)
    assert [(reason.code, reason.rule) for reason in decision.reasons] == found


def test_a_held_object_may_touch_a_volume_under_force_control_alone() -> None:
    touching = replace(CARRYING.kinds["slide"], surface=replace(SURFACE, distance=None))
    policy = replace(CARRYING, kinds={**CARRYING.kinds, "slide": touching})
    pressing = replace(TURNED, servo=servo(joint_tolerance=(0.01,)))
    assert carried(True, pressing) == [("AE763", "off-the-pillar")]
    assert carried(True, pressing, policy) == []
    assert carried(True, TURNED, policy) == [("AE763", "off-the-pillar")]
    table = replace(SURFACE, volumes=frozenset({"table"}))
    elsewhere = {**CARRYING.kinds, "slide": replace(touching, surface=table)}
    too_fast = replace(pressing, servo=servo(joint_tolerance=(0.01,), tool_speed=0.21))
    assert carried(True, too_fast, policy) == [("AE763", "off-the-pillar")]
    assert carried(True, pressing, replace(policy, kinds=elsewhere)) == [("AE763", "off-the-pillar")]
    # The arm itself may not touch it.
    assert carried(True, replace(motion(1.5, 8.0), servo=pressing.servo), policy) == [
        ("AE763", "off-the-pillar")
    ]


def test_a_held_object_keeps_apart_from_links() -> None:
    near = replace(
        FOLDING, hulls=(FOLDING.hulls[0]._replace(radius=0.01), Hull("post", 0, ((0.55, 0.3, 0.5),), 0.02))
    )
    policy = replace(APART, held=CARRYING.held)
    plan = motion(0.5, body=near)
    assert carried(False, plan, policy) == []
    assert carried(True, plan, policy) == [("AE765", "post-held")]


def servo(**changed: Any) -> ServoBounds:
    return replace(ServoBounds((0.0,), (0.5,), (2.0,), (50.0,), 0.1, 1.0, 10.0), **changed)


@pytest.mark.parametrize(
    ("changed", "rule"),
    [
        ({"joint_tolerance": (1.9,)}, ("AE762", "joint-1")),
        ({"joint_tolerance": (0.5,)}, ("AE763", "off-the-pillar")),
        ({"speed": (1.1,)}, ("AE762", "joint-1-speed")),
        ({"tool_jerk": 501.0}, ("AE762", "tool-jerk")),
        ({"tool_speed": 0.26}, ("AE762", "speed")),
    ],
)
def test_motions_under_feedback_are_decided_by_their_bounds(
    changed: dict[str, Any], rule: tuple[str, str]
) -> None:
    paths = motion().joint_paths * 2
    assert decided(motion(joint_paths=paths, servo=servo()), "slide") == []
    assert rule in decided(motion(joint_paths=paths, servo=servo(**changed)), "slide")


def test_every_path_of_several_is_decided() -> None:
    paths = (*motion().joint_paths, *motion(1.5).joint_paths)
    assert decided(motion(joint_paths=paths, servo=servo()), "slide") == [("AE763", "off-the-pillar")]


# Beside motions under way: the arm turns to 0.5 rad, 0.5 m from its axis; the base drives 0.4 m along x.

REACH = act("move", target=(0.838791280945, 0.239712769302, 0.5), speed=0.5)
DRIVE = act("drive", x=0.4, y=0.0, speed=0.2)
DRIVING = motion(0.0, 4.0, base_path=(0.4, 0.0, 0.0))
WALL = AxisAlignedBox(
    (Fraction(85, 100), Fraction(1, 5), Fraction(0)), (Fraction(2), Fraction(2), Fraction(1))
)
WALLED = replace(POLICY, barriers=(replace(POLICY.barriers[0], box=WALL),))


def beside(
    action: Action,
    plan: Trajectory,
    other: ConcurrentMotion,
    policy: MotionPolicy = POLICY,
    joint: float = 0.0,
) -> list[tuple[str, str]]:
    allowed = Decision(DecisionKind.ALLOW, action, ())
    found = MotionDecider(policy).decide(allowed, plan, {"joint_angle": Reading((joint,), 0.0)}, [other])
    assert (found.kind is DecisionKind.DENY) == bool(found.reasons)
    return [(reason.code, reason.rule) for reason in found.reasons]


def driving(since: float = 0.0, plan: Trajectory = DRIVING, is_halting: bool = False) -> ConcurrentMotion:
    return ConcurrentMotion(DRIVE, plan, since, is_halting)


def test_arm_and_base_may_move_together_if_both_end_at_their_targets() -> None:
    assert beside(REACH, motion(), driving()) == []
    # Planned for where the base is now, it ends 0.4 m beyond.
    here = act("move", target=(0.438791280945, 0.239712769302, 0.5), speed=0.5)
    assert beside(here, motion(), driving()) == [("AE761", "target")]


def test_a_drive_may_not_move_the_tool_away_from_its_target() -> None:
    reaching = ConcurrentMotion(REACH, motion(base=(0.4, 0.0, 0.0)), 0.0)
    assert beside(DRIVE, DRIVING, reaching) == []
    assert beside(DRIVE, replace(DRIVING, base_path=(0.41, 0.0, 0.0)), reaching) == [
        ("AE761", "x"),
        ("AE761", "target"),
    ]


def test_the_tool_speed_includes_the_speed_of_the_base() -> None:
    # 0.234375 m/s of the arm's own, 0.1875 m/s of the base's.
    for speed, found in ((0.423, []), (0.421, [("AE762", "speed")])):
        reach = act("move", **{**REACH.parameters, "speed": speed})
        assert beside(reach, motion(), driving()) == found
        reaching = ConcurrentMotion(reach, motion(base=(0.4, 0.0, 0.0)), 0.0)
        assert beside(DRIVE, DRIVING, reaching) == found


def test_the_base_keeps_to_its_own_speed() -> None:
    slow = ConcurrentMotion(act("drive", x=0.4, y=0.0, speed=0.18), DRIVING, 0.0)
    assert beside(REACH, motion(), slow) == [("AE762", "speed")]


def test_the_base_keeps_to_its_limits() -> None:
    policy = replace(POLICY, base_limits=(Fraction(1, 2), Fraction(9, 10)))
    for way, found in ((0.5, []), (0.55, ["base-speed"]), (0.9, ["base-speed", "base-acceleration"])):
        drive = motion(0.0, duration=2.0, base_path=(way, 0.0, 0.0))
        message = decided(drive, "drive", policy, x=way, speed=1.0)
        assert [rule for code, rule in message if code == "AE762"] == found
        assert decided(drive, "drive", x=way, speed=1.0) == []


@pytest.mark.parametrize("number", range(3))
def test_limits_of_the_tool_are_kept_in_the_world(number: int) -> None:
    # Bounds of the arm alone are 0.2344 m/s, 0.521 m/s² and 2.68 m/s³; the base adds 0.1875, 0.144 and 0.375.
    rule = ("tool-speed", "tool-acceleration", "tool-jerk")[number]
    for limits, found in (((0.422, 0.67, 3.1), []), ((0.421, 0.66, 3.0), [("AE762", rule)])):
        kept = list(POLICY.tool_limits.translation)
        kept[number] = Fraction(limits[number])
        policy = replace(
            POLICY, tool_limits=replace(POLICY.tool_limits, translation=(kept[0], kept[1], kept[2]))
        )
        assert beside(REACH, motion(), driving(), policy) == found
        assert decided(motion(), policy=policy) == []


def test_motions_that_are_safe_alone_may_be_denied_together() -> None:
    # Stretched out along x the arm is clear of the wall; turned, where the base was; not turned there.
    assert decided(motion(), policy=WALLED) == []
    assert decided(motion(0.0, 4.0, base_path=(0.4, 0.0, 0.0)), "drive", policy=WALLED, x=0.4) == []
    assert beside(REACH, motion(), driving(), WALLED) == [("AE763", "off-the-pillar")]
    assert beside(DRIVE, DRIVING, ConcurrentMotion(REACH, motion(base=(0.4, 0.0, 0.0)), 0.0), WALLED) == [
        ("AE763", "off-the-pillar")
    ]


def test_the_completed_part_of_a_motion_under_way_is_not_decided_again() -> None:
    # It has passed the pillar, which only its first half is near.
    away = motion(0.0, 4.0, base=(0.5, 0.6, 0.0), base_path=(0.0, -0.6, 0.0))
    drive = act("drive", x=0.5, y=0.0, speed=0.3)
    reach = act("move", target=(0.938791280945, 0.239712769302, 0.5), speed=0.6)
    assert beside(reach, motion(), ConcurrentMotion(drive, away, 0.0)) == [("AE763", "off-the-pillar")]
    assert beside(reach, motion(), ConcurrentMotion(drive, away, 3.0)) == []
    assert beside(reach, motion(), ConcurrentMotion(drive, away, 9.0)) == []


@pytest.mark.parametrize("since", [nan, -inf, -1.0])
def test_a_motion_with_an_invalid_clock_counts_as_not_started(since: float) -> None:
    away = motion(0.0, 4.0, base=(0.5, 0.6, 0.0), base_path=(0.0, -0.6, 0.0))
    companion = ConcurrentMotion(act("drive", x=0.5, y=0.0, speed=0.3), away, since)
    reach = act("move", target=(0.938791280945, 0.239712769302, 0.5), speed=0.6)
    assert beside(reach, motion(), companion) == [("AE763", "off-the-pillar")]


def test_a_motion_under_way_is_compared_at_its_current_position() -> None:
    # Half of its time: half of its way, 0.25 rad.
    reaching = ConcurrentMotion(REACH, motion(base=(0.4, 0.0, 0.0)), 1.0)
    drive = replace(DRIVING, joint_paths=motion(0.0).joint_paths)
    stands = tuple(tuple((q + 0.25,) for (q,) in piece) for piece in drive.joint_paths[0])
    drive = replace(drive, joint_paths=(stands,))  # type: ignore[arg-type]
    assert beside(DRIVE, drive, reaching, joint=0.25) == []
    assert beside(DRIVE, drive, reaching, joint=0.265) == [("AE761", "joint_angle")] * 2
    assert beside(DRIVE, DRIVING, reaching, joint=0.0) == [("AE761", "joint_angle")]


@pytest.mark.parametrize(
    ("plan", "other"),
    [
        (motion(), ConcurrentMotion(REACH, motion(), 0.0)),
        (DRIVING, driving()),
        (motion(base_path=(0.1, 0.0, 0.0)), driving()),
        (motion(), driving(is_halting=True)),
        (motion(), driving(plan=replace(DRIVING, joint_paths=()))),
        (motion(), driving(plan=replace(DRIVING, duration=0.0))),
        (motion(), driving(plan=replace(DRIVING, body=replace(BODY, tool_offset=(0.4, 0.0, 0.5))))),
        (motion(joint_paths=motion().joint_paths * 2, servo=servo()), driving()),
        (DRIVING, ConcurrentMotion(act("slide", speed=0.25), motion(servo=servo()), 0.0)),
    ],
)
def test_motions_that_cannot_be_decided_together_are_denied(
    plan: Trajectory, other: ConcurrentMotion
) -> None:
    action = DRIVE if plan is DRIVING else REACH
    assert beside(action, plan, other) == [("AE764", action.kind)]


def test_a_motion_that_moves_nothing_may_run_with_any() -> None:
    still = replace(DRIVING, base_path=NOWHERE)
    here = act("drive", x=0.0, y=0.0, speed=0.2)
    assert (
        beside(
            here,
            still,
            ConcurrentMotion(
                act("move", target=(0.438791280945, 0.239712769302, 0.5), speed=0.3), motion(), 0.0
            ),
        )
        == []
    )
    assert beside(here, still, driving()) == [("AE761", "x")]


def test_an_obstacle_on_the_way_is_named_with_its_place_and_size() -> None:
    box = Obstacle("unknown-object-1", (0.35, 0.15, 0.4), (0.45, 0.25, 0.6), 1.0, "overhead", "bench")
    far = box._replace(name="unknown-object-2", lower=(-0.9, 0.0, 0.0), upper=(-0.8, 0.1, 0.1))
    target = (0.438791280945, 0.239712769302, 0.5)
    allowed = Decision(DecisionKind.ALLOW, act("move", target=target, speed=0.25), ())
    readings = {"joint_angle": Reading((0.0,), 0.0)}
    decider = MotionDecider(POLICY)
    assert decider.decide(allowed, motion(), readings, (), (far,)) is allowed
    found = decider.decide(allowed, motion(), readings, (), (far, box))
    assert found.kind is DecisionKind.DENY
    (reason,) = found.reasons
    assert (reason.code, reason.rule) == ("AE766", "unknown-object-1")
    assert reason.text == (
        "`arm` may come nearer than 10 mm to unknown-object-1 at (0.40, 0.20) m in bench, 100 x 100 x 200 mm "
        "at 41 % of the path, and at its target; `overhead` saw it"
    )


def test_an_obstacle_is_passed_on_the_way_to_a_target_that_is_clear_of_it() -> None:
    box = Obstacle("unknown-object-1", (0.45, 0.0, 0.4), (0.5, 0.05, 0.6), 1.0, "overhead", "bench")
    target = (0.438791280945, 0.239712769302, 0.5)
    allowed = Decision(DecisionKind.ALLOW, act("move", target=target, speed=0.25), ())
    found = MotionDecider(POLICY).decide(allowed, motion(), {"joint_angle": Reading((0.0,), 0.0)}, (), (box,))
    assert [reason.text.count("at its target") for reason in found.reasons] == [0]


def test_a_motion_from_its_joints_and_to_its_target_within_exactly_the_tolerance() -> None:
    policy = replace(POLICY, start_tolerance=Fraction(1, 64), end_tolerance=Fraction(1, 1024))
    assert decided(motion(), "slide", policy, joint=1 / 64) == []
    drive = motion(0.0, 4.0, base_path=(0.5, 0.0, 0.0))
    assert decided(drive, "drive", policy, x=0.5 + 1 / 1024) == []
    assert decided(drive, "drive", policy, x=0.5, y=1 / 1024) == []


def test_a_motion_under_way_that_moves_nothing_keeps_to_any_speed() -> None:
    still = ConcurrentMotion(act("drive", x=0.0, y=0.0, speed=0.01), replace(DRIVING, base_path=NOWHERE), 0.0)
    here = act("move", target=(0.438791280945, 0.239712769302, 0.5), speed=0.25)
    assert beside(here, motion(), still) == []


def test_a_surface_of_a_barrier_for_all_links_is_touched_slowly() -> None:
    kinds = {**CARRYING.kinds, "slide": replace(CARRYING.kinds["slide"], surface=SURFACE)}
    policy = replace(CARRYING, kinds=kinds, barriers=(replace(CARRYING.barriers[0], links=None),))
    assert carried(True, turn(0.0, 0.9, 4.0), policy) == []
    assert carried(True, turn(0.0, 0.9, 2.0), policy) == [("AE763", "off-the-pillar")]


def test_a_held_object_that_may_touch_one_volume_keeps_clear_of_others() -> None:
    other = replace(CARRYING.barriers[0], id="off-the-shelf", volume="shelf")
    kinds = {**CARRYING.kinds, "slide": replace(CARRYING.kinds["slide"], surface=SURFACE)}
    policy = replace(CARRYING, kinds=kinds, barriers=(*CARRYING.barriers, other))
    assert carried(True, turn(0.0, 0.9, 4.0), policy) == [("AE763", "off-the-shelf")]
    assert carried(False, turn(0.0, 0.9, 4.0), policy) == []


def reasons(plan: Any, policy: MotionPolicy, joint: float = 0.0) -> str:
    """The texts of a denial, without regard to where the tool ends and how fast it is."""
    allowed = Decision(DecisionKind.ALLOW, act("wave", speed=5.0), ())
    kinds = {"wave": MotionKind(None, None, "speed")}
    found = MotionDecider(replace(policy, kinds=kinds)).decide(
        allowed, plan, {"joint_angle": Reading((joint,), 0.0)}
    )
    return "; ".join(one.text for one in found.reasons)


CEILING = AxisAlignedBox((Fraction(-1), Fraction(-1), Fraction(1)), (Fraction(1), Fraction(1), Fraction(2)))
SLIDING = replace(BODY, dh_rows=((0.0, 0.0, 0.0, 0.0, PRISMATIC),))
MIXED = replace(POLICY, is_mixed=True)


def test_a_prismatic_joint_is_refused_by_a_site_whose_joints_are_in_rad() -> None:
    plan = motion(body=SLIDING)
    assert decided(plan) == [("AE760", "move")]
    assert reasons(plan, POLICY) == (
        "the motion is malformed: joint 1 is prismatic, and the site has joint positions in rad, not in jpos"
    )


def test_a_prismatic_joint_needs_a_lever_of_one() -> None:
    tracking = Tracking("error", Fraction(1, 100), (Fraction(1, 2),))
    assert "the site's lever of it is below 1 m/jpos" in reasons(
        motion(body=SLIDING), replace(MIXED, tracking=tracking)
    )


def test_limits_and_places_of_a_prismatic_joint_are_in_the_sites_unit() -> None:
    # From z = 0.5 m up by 0.3 m in 2 s; peak speed 1.875 times the mean.
    plan = motion(angle=0.3, body=SLIDING)
    slow = replace(MIXED, joint_limits=((Fraction(1, 4),), (Fraction(5),), (Fraction(500),)))
    assert reasons(plan, slow) == "the speed of joint 1 may reach 0.2813 jpos/s; the limit is 0.25 jpos/s"
    narrow = replace(MIXED, highest=(Fraction(1, 4),))
    assert "joint 1 may be from 0 to 0.3 jpos; its limits are -2 and 0.25 jpos" in reasons(plan, narrow)
    assert "0.1 jpos from the measured position of a joint" in reasons(plan, MIXED, joint=-0.1)


def test_a_prismatic_joint_meets_a_ceiling_only_if_it_rises_that_far() -> None:
    low, high = motion(angle=0.3, body=SLIDING), motion(angle=0.6, body=SLIDING)
    ceiling = Barrier("under-the-ceiling", "ceiling", CEILING, False, False, None, "it is glass")
    policy = replace(MIXED, barriers=(ceiling,))
    assert reasons(low, policy) == ""
    assert "`arm` enters the volume `ceiling` by 160 mm" in reasons(high, policy)


def test_exactly_at_a_limit_a_motion_is_allowed() -> None:
    """All numbers are exact in binary: 0.5 rad are the lowest, the highest, and the target."""
    for angle in (0.5, -0.5):
        at_end = replace(POLICY, lowest=(Fraction(min(angle, 0.0)),), highest=(Fraction(max(angle, 0.0)),))
        assert decided(motion(angle), "slide", at_end) == []
    drive = motion(0.0, 4.0, base_path=(0.5, 0.0, 0.0))
    (speed, acceleration, _) = base_rates(drive.base_path, drive.duration)
    limits = replace(POLICY, base_limits=(Fraction(speed), Fraction(acceleration)))
    assert decided(drive, "drive", limits, x=0.5, speed=speed) == []
    assert decided(drive, "drive", limits, x=0.5, speed=nextafter(speed, 0.0)) == [("AE762", "speed")]
    for number, rule in enumerate(("base-speed", "base-acceleration")):
        below = [Fraction(speed), Fraction(acceleration)]
        below[number] *= Fraction(999, 1000)
        assert decided(drive, "drive", replace(limits, base_limits=(below[0], below[1])), x=0.5) == [
            ("AE762", rule)
        ]
    near = replace(POLICY, end_tolerance=Fraction(1, 4))
    assert decided(motion(0.0), policy=near, target=(0.75, 0.0, 0.5)) == []
    assert decided(motion(0.0), policy=near, target=(0.7500001, 0.0, 0.5)) == [("AE761", "target")]
    assert decided(motion(0.0), "turn", angle=1e-6) == []


def test_a_base_that_nobody_measures_is_where_the_motion_has_it() -> None:
    assert decided(motion(), policy=replace(TRACKED, base_variable=None)) == []
    assert decided(motion(), policy=replace(TRACKED, tracking=None)) == []


def test_a_lever_of_exactly_one_is_enough() -> None:
    for lever, found in ((Fraction(1), []), (Fraction(999, 1000), [("AE760", "slide")])):
        tracked = replace(
            POLICY, is_mixed=True, barriers=(), tracking=Tracking("off", Fraction(1, 100), (lever,))
        )
        rising = motion(0.1, body=replace(BODY, dh_rows=((0.0, 0.0, 0.0, 0.0, PRISMATIC),)))
        assert decided(rising, "slide", tracked) == found


def test_a_held_object_touches_no_surface_while_another_motion_is_under_way() -> None:
    kinds = {**CARRYING.kinds, "slide": replace(CARRYING.kinds["slide"], surface=SURFACE)}
    policy = replace(CARRYING, kinds=kinds)
    plan = turn(0.0, 0.9, 4.0)
    standing = ConcurrentMotion(
        act("drive", x=0.01, y=0.0, speed=0.5), motion(0.0, 4.0, base_path=(0.01, 0.0, 0.0)), 0.0
    )
    readings = {"joint_angle": Reading((0.0,), 0.0), "holding": Reading(True, 0.0)}
    allowed = Decision(DecisionKind.ALLOW, act("slide", speed=0.5), ())
    for others, found in (((), []), ((standing,), [("AE763", "off-the-pillar")])):
        decision = MotionDecider(policy).decide(allowed, plan, readings, others)
        assert [(reason.code, reason.rule) for reason in decision.reasons] == found
