"""Deciding a whole motion: each way in which one is not in order, and that nothing else objects."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from math import inf, nan
from typing import Any, cast

import pytest

from aeros.runtime.decision import Decision, Verdict
from aeros.runtime.ports import Ball, Body, Completion, Motionless, Reading, Servo, Trajectory, Triple
from aeros.runtime.trajectory import MotionDecider
from aeros.skill import act
from aeros.spec.expr.scope import Box
from aeros.spec.model import Barrier, MotionKind, MotionPolicy, ToolLimits

NOWHERE = (0.0, 0.0, 0.0)
PILLAR = Box((Fraction(0), Fraction(1, 2), Fraction(0)), (Fraction(1), Fraction(2), Fraction(1)))
POLICY = MotionPolicy(
    kinds={
        "move": MotionKind("target", None, "speed"),
        "slide": MotionKind(None, None, "speed"),
        "drive": MotionKind(None, ("x", "y"), "speed"),
    },
    starts_at="joint_angle",
    starts_within=Fraction(1, 100),
    ends_within=Fraction(1, 1000),
    lowest=(Fraction(-2),),
    highest=(Fraction(2),),
    rates=((Fraction(1),), (Fraction(5),), (Fraction(500),)),
    tool=ToolLimits((Fraction(1), Fraction(5), Fraction(500)), (Fraction(1), Fraction(5), Fraction(500))),
    clearance=Fraction(1, 100),
    barriers=(
        Barrier("off-the-pillar", "pillar", PILLAR, False, False, frozenset({"arm"}), "it holds the roof"),
    ),
)
BODY = Body(
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
    joint: float = 0.0,
    speed: float = 0.25,
    **more: Any,
) -> list[tuple[str, str]]:
    target = (0.438791280945, 0.239712769302, 0.5)
    parameters = {"target": target, "x": 0.0, "y": 0.0, "speed": speed, **more}
    allowed = Decision(Verdict.ALLOW, act(kind, **parameters), ())
    found = MotionDecider(policy).decide(allowed, plan, {"joint_angle": Reading((joint,), 0.0)})
    assert (found.verdict is Verdict.DENY) == bool(found.reasons)
    assert found == allowed or found.action is None
    return [(reason.code, reason.rule) for reason in found.reasons]


def test_a_motion_in_order_stays_allowed() -> None:
    assert decided(motion()) == []


def test_a_denied_action_and_kinds_that_are_not_governed_are_left_as_they_are() -> None:
    denied = Decision(Verdict.DENY, None, ())
    assert MotionDecider(POLICY).decide(denied, motion(), {}) is denied
    assert decided(None, "wait") == []
    assert MotionDecider(None).governs("move") is False


def test_a_plant_that_moves_nothing_or_cannot_do_it_is_believed() -> None:
    assert decided(Motionless("no body")) == []
    assert decided(Completion(False, "unreachable")) == []


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
        motion(way=(0.0, 0.0)),
        motion(paths=()),
        motion(paths=((),)),
        motion(paths=None),
        motion(paths=motion().paths * 2),
        motion(paths=(((0.0,), (0.0,), (0.0,), (0.0,)),)),
        motion(paths=((((0.0,), (0.1,), (0.2,)),),)),
        motion(paths=((((0.0, 0.0),) * 4,),)),
        # A jump of position, of slope, of bend.
        motion(paths=(motion(0.2).paths[0] * 2,)),
        motion(paths=((((0.0,),) * 4, ((0.0,), (0.1,), (0.2,), (0.3,))),)),
        motion(paths=((((0.0,),) * 4, ((0.0,), (0.0,), (0.1,), (0.3,))),)),
        motion(body=replace(BODY, rows=BODY.rows * 2)),
        motion(body=replace(BODY, tool=cast("Triple", (0.0, 0.0)))),
        motion(body=replace(BODY, balls=())),
        motion(body=replace(BODY, balls=(Ball("leg", 1, NOWHERE, 0.1),))),
        motion(body=replace(BODY, balls=(Ball("arm", 2, NOWHERE, 0.1),))),
        motion(body=replace(BODY, balls=(Ball("arm", 1, NOWHERE, -0.1),))),
        motion(body=replace(BODY, balls=(Ball("arm", 1, NOWHERE, nan),))),
        motion(servo=Servo((), (1.0,), (1.0,), (1.0,), 0.1, 0.1, 0.1)),
        motion(servo=Servo((nan,), (1.0,), (1.0,), (1.0,), 0.1, 0.1, 0.1)),
        motion(way=(1.0, 0.0, 0.0), servo=Servo((0.1,), (1.0,), (1.0,), (1.0,), 0.1, 0.1, 0.1)),
    ],
)
def test_a_motion_of_which_nothing_can_be_said_is_denied(plan: Any) -> None:
    assert decided(plan) == [("AE760", "move")]


def test_a_motion_starts_where_the_joints_are_and_ends_where_it_is_asked_to() -> None:
    assert decided(motion(), joint=0.02) == [("AE761", "joint_angle")]
    assert decided(motion(0.49)) == [("AE761", "target")]
    drive = motion(0.0, 4.0, way=(0.5, 0.0, 0.0))
    assert decided(drive, "drive", x=0.5) == []
    assert decided(drive, "drive", x=0.502) == [("AE761", "x")]


def test_joints_that_are_not_measured_are_a_reason() -> None:
    allowed = Decision(Verdict.ALLOW, act("slide", speed=0.25), ())
    found = MotionDecider(POLICY).decide(allowed, motion(), {})
    assert [(reason.code, reason.rule) for reason in found.reasons] == [("AE761", "joint_angle")]


@pytest.mark.parametrize(
    ("changed", "rules"),
    [
        # 0.5 rad in T: 0.9375/T, 2.887/T², 30/T³; the tool, 0.5 m out, half of each.
        ({"highest": (Fraction(49, 100),)}, ["joint-1"]),
        ({"lowest": (Fraction(1, 100),)}, ["joint-1"]),
        ({"rates": ((Fraction(46, 100),), (Fraction(5),), (Fraction(500),))}, ["joint-1-speed"]),
        ({"rates": ((Fraction(1),), (Fraction(72, 100),), (Fraction(500),))}, ["joint-1-acceleration"]),
        ({"rates": ((Fraction(1),), (Fraction(5),), (Fraction(3),))}, ["joint-1-jerk"]),
        (
            {
                "tool": ToolLimits(
                    (Fraction(23, 100), Fraction(5), Fraction(500)), (Fraction(1), Fraction(5), Fraction(500))
                )
            },
            ["tool-speed"],
        ),
        (
            {
                "tool": ToolLimits(
                    (Fraction(1), Fraction(36, 100), Fraction(500)), (Fraction(1), Fraction(5), Fraction(500))
                )
            },
            ["tool-acceleration"],
        ),
        (
            {
                "tool": ToolLimits(
                    (Fraction(1), Fraction(5), Fraction(1)), (Fraction(1), Fraction(5), Fraction(500))
                )
            },
            ["tool-jerk"],
        ),
        (
            {
                "tool": ToolLimits(
                    (Fraction(1), Fraction(5), Fraction(500)), (Fraction(46, 100), Fraction(5), Fraction(500))
                )
            },
            ["tool-turning-speed"],
        ),
        (
            {
                "tool": ToolLimits(
                    (Fraction(1), Fraction(5), Fraction(500)), (Fraction(1), Fraction(72, 100), Fraction(500))
                )
            },
            ["tool-turning-acceleration"],
        ),
        (
            {
                "tool": ToolLimits(
                    (Fraction(1), Fraction(5), Fraction(500)), (Fraction(1), Fraction(5), Fraction(3))
                )
            },
            ["tool-turning-jerk"],
        ),
    ],
)
def test_each_limit_is_kept(changed: dict[str, Any], rules: list[str]) -> None:
    assert decided(motion(), policy=replace(POLICY, **changed)) == [("AE762", rule) for rule in rules]


def test_the_tool_keeps_to_the_speed_that_was_decided() -> None:
    # The peak is 0.234375 m/s.
    assert decided(motion(), speed=0.2345) == []
    assert decided(motion(), speed=0.2343) == [("AE762", "speed")]
    assert decided(motion(0.0, 4.0, way=(0.5, 0.0, 0.0)), "drive", x=0.5, speed=0.234) == [("AE762", "speed")]


def test_no_link_meets_a_barrier() -> None:
    assert decided(motion(1.5, 8.0), "slide") == [("AE763", "off-the-pillar")]
    away = replace(POLICY, barriers=(replace(POLICY.barriers[0], in_base=True),))
    beside = motion(1.5, 8.0, base=(0.0, -1.0, 0.0))
    assert decided(beside, "slide") == []
    assert decided(beside, "slide", policy=away) == [("AE763", "off-the-pillar")]


def servo(**changed: Any) -> Servo:
    return replace(Servo((0.0,), (0.5,), (2.0,), (50.0,), 0.1, 1.0, 10.0), **changed)


@pytest.mark.parametrize(
    ("changed", "rule"),
    [
        ({"slack": (1.9,)}, ("AE762", "joint-1")),
        ({"slack": (0.5,)}, ("AE763", "off-the-pillar")),
        ({"speed": (1.1,)}, ("AE762", "joint-1-speed")),
        ({"tool_jerk": 501.0}, ("AE762", "tool-jerk")),
        ({"tool_speed": 0.26}, ("AE762", "speed")),
    ],
)
def test_what_feedback_may_do_is_decided_too(changed: dict[str, Any], rule: tuple[str, str]) -> None:
    paths = motion().paths * 2
    assert decided(motion(paths=paths, servo=servo()), "slide") == []
    assert rule in decided(motion(paths=paths, servo=servo(**changed)), "slide")


def test_every_path_of_several_is_decided() -> None:
    paths = (*motion().paths, *motion(1.5).paths)
    assert decided(motion(paths=paths, servo=servo()), "slide") == [("AE763", "off-the-pillar")]
