"""Measured joints and base are compared with the motions that were decided."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from math import hypot, nan, sin
from typing import Any

import pytest

from aeros.runtime.monitor.tracking import FeedbackRates, MotionTracker, greatest_displacement
from aeros.runtime.ports import Hull, NoMotion, Reading, RobotBody, ServoBounds, Trajectory
from aeros.spec.model.motion import MotionPolicy, Tracking
from tests.unit.runtime.motion.test_trajectory import POLICY as DECIDED

TICK = 1.0 / 240.0
BODY = RobotBody(((0.0, 0.0, 0.0),), (0.5, 0.0, 0.0), ())
"""One joint with the tool half a metre from its axis."""


def rates(joint_speed: float, tool_speed: float) -> FeedbackRates:
    bounds = ServoBounds((0.01,), (joint_speed,), (9.0,), (9.0,), tool_speed, 9.0, 9.0)
    path = ((((0.0,), (0.0,), (1.0,), (1.0,)),),)
    return FeedbackRates(Trajectory(BODY, path, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0, bounds), "q")


def is_found(one: FeedbackRates, speed: float, ticks: int = 48) -> bool:
    return any(one.unmet_bounds(tick * TICK, {"q": (speed * tick * TICK,)}) for tick in range(ticks))


@pytest.mark.parametrize(("speed", "found"), [(0.2, False), (0.29, False), (0.4, True), (-0.4, True)])
def test_a_joint_that_is_faster_than_declared_is_found(speed: float, found: bool) -> None:
    assert is_found(rates(0.2, 9.0), speed) is found


@pytest.mark.parametrize(("speed", "found"), [(0.2, False), (0.3, False), (0.5, True)])
def test_a_tool_that_is_faster_than_declared_is_found(speed: float, found: bool) -> None:
    assert is_found(rates(9.0, 0.1), speed) is found


def test_readings_count_at_their_own_times() -> None:
    one = rates(0.2, 9.0)
    assert not one.unmet_bounds(0.0, {"q": Reading((0.0,), 0.0)})
    assert not one.unmet_bounds(0.02, {"q": Reading((0.5,), 0.0)})  # not measured anew
    (joint,) = one.unmet_bounds(0.03, {"q": Reading((0.5,), 0.03)})
    assert str(joint) == "way of joint 1 in 0.03 s is 0.5 rad (at most 0.011 rad)"


@pytest.mark.parametrize("odd", [None, 3.0, "x", (nan,), (0.0, 0.0), (1,), ("x",), Reading(None, 0.0)])
def test_malformed_joints_are_left_to_other_checks(odd: Any) -> None:
    assert not rates(0.0, 0.0).unmet_bounds(1.0, {"q": odd})


# Where the robot is.

NOWHERE = (0.0, 0.0, 0.0)
ARM = RobotBody(
    ((0.0, 0.0, 0.0), (0.5, 0.0, 0.0)),
    (0.5, 0.0, 0.0),
    (),
    (Hull("upper", 1, (NOWHERE, (0.5, 0.0, 0.0)), 0.05), Hull("lower", 2, (NOWHERE, (0.5, 0.0, 0.0)), 0.05)),
)
"""Two joints in a plane, each half a metre from what it carries next."""
POLICY = replace(
    DECIDED,
    start_variable="q",
    base_variable="base",
    tracking=Tracking("off", Fraction(1, 100), (Fraction(1),) * 2),
)
LEVERS = (1.0, 1.0)
TURN = Trajectory(ARM, ((((0.0, 0.0), (0.0, 0.0), (0.0, 0.3), (0.0, 0.3)),),), NOWHERE, NOWHERE, 1.0)
DRIVE = replace(TURN, joint_paths=((((0.0, 0.0),) * 4,),), base_path=(0.4, 0.0, 0.0), duration=2.0)


def share(u: float) -> float:
    u = min(u, 1.0)
    return u**3 * (10.0 - 15.0 * u + 6.0 * u * u)


def turned(time: float) -> tuple[float, float]:
    """Joints of `TURN` at a time, by Bernstein's polynomials."""
    x = share(time)
    return (0.0, 0.3 * (3.0 * (1.0 - x) * x * x + x**3))


def driven(time: float) -> tuple[float, float, float]:
    """Base of `DRIVE` at a time."""
    return (0.4 * share(time / 2.0), 0.0, 0.0)


def aside(time: float) -> tuple[float, float, float]:
    return (driven(time)[0], 0.008, 0.0)


def still(*joints: float) -> Callable[[float], tuple[float, ...]]:
    return lambda _: joints


def tracked(*plans: Trajectory, policy: MotionPolicy = POLICY) -> MotionTracker:
    one = MotionTracker(policy)
    for number, plan in enumerate(plans):
        one.add(number, plan)
    return one


def first_fault(
    one: MotionTracker, joints: Callable[[float], Any], base: Callable[[float], Any] = lambda _: NOWHERE
) -> str | None:
    """The first fault in 1.2 s of ticks, of which the first is that at which the motion begins."""
    for tick in range(288):
        time = tick * TICK
        fault = one.violation(5.0 + time, {"q": joints(time), "base": base(time), "off": 0.0})
        if fault is not None:
            return fault
    return None


@pytest.mark.parametrize(
    ("joints", "fault"),
    [
        (turned, None),
        (lambda time: (0.004, turned(time)[1] - 0.004), None),
        (lambda time: (0.02, turned(time)[1]), "decided-path"),
        (lambda _: (0.0, 0.0), "decided-path"),  # it stands
        (lambda time: turned(time - 0.05), "decided-path"),  # it lags
        (lambda time: (0.0, 0.3 * time), "decided-path"),  # it keeps another time
        (lambda time: turned(min(time, 0.6)), "decided-path"),  # it ends before its end
        (lambda _: None, "input:q"),
        (lambda _: (0.0,), "input:q"),
        (lambda _: (nan, 0.0), "input:q"),
        (lambda _: ("x", 0.0), "input:q"),
    ],
)
def test_joints_follow_their_path_in_time(joints: Callable[[float], Any], fault: str | None) -> None:
    assert first_fault(tracked(TURN), joints) == fault


def test_the_sum_over_joints_is_refined_where_it_does_not_suffice() -> None:
    """Both joints are off by 9 mrad in opposite directions: no link is off by more than 5 mm."""
    assert first_fault(tracked(TURN), lambda time: (0.009, turned(time)[1] - 0.009)) is None
    assert first_fault(tracked(TURN), lambda time: (0.009, turned(time)[1] + 0.009)) == "decided-path"


def test_displacements_of_links_are_exact_also_seen_from_each_other() -> None:
    assert greatest_displacement(ARM, (0.0, 0.0), (0.0, 0.0), LEVERS) == 0.0
    assert greatest_displacement(ARM, (0.0, 0.0), (0.1, 0.0), LEVERS) == pytest.approx(2.0 * sin(0.05))
    # The second joint undoes what the first one does, but not seen from the first link.
    upper = greatest_displacement(ARM, (0.0, 0.0), (0.1, -0.2), LEVERS)
    assert upper == pytest.approx(2.0 * 0.5 * sin(0.1))
    assert upper > hypot(0.5 * sin(0.1) - 0.5 * sin(0.1), 0.0)


def test_the_base_follows_its_path_and_counts_with_the_joints() -> None:
    assert first_fault(tracked(DRIVE), lambda _: (0.0, 0.0), driven) is None
    assert first_fault(tracked(DRIVE), lambda _: (0.0, 0.0)) == "decided-path"
    assert first_fault(tracked(DRIVE), lambda _: (0.0, 0.0), lambda _: None) == "input:base"
    assert first_fault(tracked(DRIVE), lambda _: (0.0, 0.0), aside) is None
    assert first_fault(tracked(DRIVE), lambda _: (0.004, 0.0), aside) == "decided-path"
    assert first_fault(tracked(TURN), turned, lambda _: (0.02, 0.0, 0.0)) == "decided-path"


def test_two_motions_are_followed_together_and_what_has_ended_stays() -> None:
    assert first_fault(tracked(DRIVE, TURN), turned, driven) is None
    assert first_fault(tracked(TURN, DRIVE), turned, driven) is None
    assert first_fault(tracked(DRIVE, TURN), lambda _: (0.0, 0.0), driven) == "decided-path"
    one = tracked(DRIVE, TURN)
    assert first_fault(one, turned, driven) is None
    one.remove(1)
    assert one.violation(6.5, {"q": (0.0, 0.3), "base": driven(1.5)}) is None
    assert one.violation(6.5, {"q": (0.0, 0.2), "base": driven(1.5)}) == "decided-path"
    one.remove(0)
    assert one.is_idle
    assert one.violation(9.0, {}) is None


def test_a_halted_motion_is_compared_with_where_it_came_to_rest() -> None:
    one, base = tracked(DRIVE, TURN), (0.0, 0.0, 0.0)
    assert one.violation(5.0, {"q": (0.0, 0.0), "base": base}) is None
    one.halt(1)
    assert one.violation(5.0, {"q": (0.0, 0.1), "base": base}) is None
    one.remove(1)
    assert one.violation(5.0, {"q": (0.0, 0.12), "base": base}) is None
    assert one.violation(5.0, {"q": (0.0, 0.12), "base": base}) is None
    assert one.violation(5.0, {"q": (0.0, 0.15), "base": base}) == "decided-path"
    assert re.fullmatch(r"distance from the decided path is 0\.\d+ m \(at most 0\.01 m\)", str(one.deviation))


def test_readings_are_compared_with_the_path_at_their_own_time() -> None:
    one = tracked(TURN)
    assert one.violation(5.0, {"q": (0.0, 0.0), "base": NOWHERE}) is None
    late = {"q": Reading(turned(0.4), 5.4), "base": NOWHERE}
    assert one.violation(5.5, late) is None
    assert one.violation(5.5, {**late, "q": turned(0.4)}) == "decided-path"


def test_joints_under_feedback_stay_in_the_boxes_of_their_paths() -> None:
    bounds = ServoBounds((0.01, 0.01), (9.0, 9.0), (9.0, 9.0), (9.0, 9.0), 9.0, 9.0, 9.0)
    beside = (((0.1, 0.0), (0.1, 0.0), (0.1, 0.3), (0.1, 0.3)),)
    sliding = replace(TURN, joint_paths=(TURN.joint_paths[0], beside), servo=bounds)
    for joints in ((0.0, 0.0), (0.01, 0.3), (0.09, 0.15), (0.015, 0.1)):
        assert first_fault(tracked(sliding), still(*joints)) is None
    for joints in ((0.05, 0.1), (0.0, -0.05), (0.1, 0.35)):
        assert first_fault(tracked(sliding), still(*joints)) == "decided-path"


def test_speeds_under_feedback_are_compared_too() -> None:
    bounds = ServoBounds((0.5, 0.5), (0.1, 0.1), (9.0, 9.0), (9.0, 9.0), 9.0, 9.0, 9.0)
    assert first_fault(tracked(replace(TURN, servo=bounds)), lambda time: (0.0, 0.05 * time)) is None
    assert (
        first_fault(tracked(replace(TURN, servo=bounds)), lambda time: (0.0, 0.3 * time)) == "declared-rates"
    )


def test_nothing_is_compared_without_a_motion_or_a_bound() -> None:
    idle = MotionTracker(POLICY)
    idle.add(0, NoMotion("it looks"))
    assert idle.is_idle
    idle.halt(0)
    idle.remove(0)
    assert idle.violation(0.0, {}) is None
    assert first_fault(tracked(TURN, policy=replace(POLICY, tracking=None)), lambda _: (9.0, 9.0)) is None
    assert MotionTracker(None).is_idle
