"""Measured joints and base are compared with the motions that were decided."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from fractions import Fraction
from math import hypot, nan, nextafter, sin
from typing import Any

import pytest

from aeros.runtime.gate.violation import MotionDeviation
from aeros.runtime.monitor.tracking import FeedbackRates, MotionTracker, greatest_displacement
from aeros.runtime.ports import Ball, Hull, NoMotion, Reading, RobotBody, ServoBounds, Trajectory
from aeros.spec.expr.shortfall import UnmetBound
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


def test_ways_are_compared_with_their_bounds_over_the_last_window() -> None:
    one = rates(0.0, 99.0)
    assert not one.unmet_bounds(0.0, {"q": (0.0,)})
    assert not one.unmet_bounds(0.05, {"q": (0.005,)})  # the tolerance, and a whole window
    assert len(one.unmet_bounds(0.05 + TICK, {"q": (0.5,)})) == 1
    one = rates(0.0, 99.0)
    assert not one.unmet_bounds(0.0, {"q": (0.0,)})
    assert len(one.unmet_bounds(0.05, {"q": (0.5,)})) == 1  # a tick that old still counts


def test_the_way_of_the_tool_is_that_of_the_last_frame() -> None:
    bounds = ServoBounds((9.0, 9.0), (99.0, 99.0), (9.0, 9.0), (9.0, 9.0), 0.5, 9.0, 9.0)
    one = FeedbackRates(replace(TURN, servo=bounds), "q")
    assert not one.unmet_bounds(0.0, {"q": (0.0, 0.0)})
    (tool,) = one.unmet_bounds(0.02, {"q": (0.0, 0.5)})
    assert str(tool) == f"way of the tool in 0.02 s is {sin(0.25):.4g} m (at most 0.013 m)"


def test_bounds_and_levers_are_one_for_each_joint() -> None:
    bounds = ServoBounds((9.0,), (9.0, 9.0), (9.0,), (9.0,), 9.0, 9.0, 9.0)
    one = FeedbackRates(Trajectory(BODY, ((((0.0,),) * 4,),), NOWHERE, NOWHERE, 1.0, bounds), "q")
    with pytest.raises(ValueError, match="zip"):
        one.unmet_bounds(0.0, {"q": (0.0,)})
    with pytest.raises(ValueError, match="zip"):
        greatest_displacement(ARM, (0.0, 0.0), (0.1, 0.0), (1.0, 1.0, 1.0))
    tolerances = replace(bounds, joint_tolerance=(9.0, 9.0, 9.0))
    with pytest.raises(ValueError, match="zip"):
        tracked(replace(TURN, servo=tolerances))


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
    assert greatest_displacement(ARM, (0.1, 0.0), (-0.1, 0.0), LEVERS) == pytest.approx(2.0 * sin(0.1))


def test_corners_of_hulls_are_displaced_and_balls_stand_for_hulls_that_are_missing() -> None:
    far = Hull("far", 1, ((3.0, 0.0, 0.0),), 0.05)
    ball = Ball("ball", 1, (4.0, 0.0, 0.0), 0.1)
    levers = (9.0, 9.0)
    for body, radius in (
        (replace(ARM, hulls=(far,), balls=(ball,)), 3.0),
        (replace(ARM, hulls=(), balls=(ball,)), 4.0),
        (replace(ARM, hulls=(), balls=()), 1.0),  # the tool
    ):
        found = greatest_displacement(body, (0.0, 0.0), (0.1, 0.0), levers)
        assert found == pytest.approx(2.0 * radius * sin(0.05))


def test_the_base_follows_its_path_and_counts_with_the_joints() -> None:
    assert first_fault(tracked(DRIVE), lambda _: (0.0, 0.0), driven) is None
    assert first_fault(tracked(DRIVE), lambda _: (0.0, 0.0)) == "decided-path"
    assert first_fault(tracked(DRIVE), lambda _: (0.0, 0.0), lambda _: None) == "input:base"
    assert first_fault(tracked(DRIVE), lambda _: (0.0, 0.0), aside) is None
    assert first_fault(tracked(DRIVE), lambda _: (0.004, 0.0), aside) == "decided-path"
    assert first_fault(tracked(TURN), turned, lambda _: (0.02, 0.0, 0.0)) == "decided-path"


def de_casteljau(piece: Sequence[Sequence[float]], x: float) -> tuple[float, ...]:
    """A point of a Bézier curve, by repeated interpolation."""
    while len(piece) > 1:
        piece = [
            [a + x * (b - a) for a, b in zip(one, other, strict=True)]
            for one, other in itertools.pairwise(piece)
        ]
    return tuple(piece[0])


BENT = (
    ((0.1, -0.4), (0.2, -0.1), (0.5, 0.3), (0.4, 0.2)),
    ((0.4, 0.2), (0.3, 0.1), (-0.2, 0.6), (0.1, 0.7)),
)
"""Two pieces on which no coefficient is 0."""


@pytest.mark.parametrize("time", [0.0, 0.3, 0.9, 1.1, 1.7, 2.0, 2.6])
def test_joints_and_base_are_where_their_curves_are_at_that_time(time: float) -> None:
    plan = replace(DRIVE, joint_paths=(BENT,), base=(1.0, 2.0, 3.0), base_path=(0.4, -0.2, 0.3))
    tight = replace(POLICY, tracking=Tracking("off", Fraction(1, 10**9), (Fraction(1),) * 2))
    place = 2.0 * share(time / 2.0)
    number = min(int(place), 1)
    joints, s = de_casteljau(BENT[number], place - number), share(time / 2.0)
    base = (1.0 + 0.4 * s, 2.0 - 0.2 * s, 3.0 + 0.3 * s)
    one = tracked(plan, policy=tight)
    one.violation(5.0, {"q": BENT[0][0], "base": plan.base})
    assert one.violation(5.0 + time, {"q": joints, "base": base}) is None
    for axis in range(3):
        beside = tuple(value + 1e-6 * (place == axis) for place, value in enumerate(base))
        assert one.violation(5.0 + time, {"q": joints, "base": beside}) == "decided-path"
    for joint in range(2):
        other = tuple(value + 1e-6 * (place == joint) for place, value in enumerate(joints))
        assert one.violation(5.0 + time, {"q": other, "base": base}) == "decided-path"


def test_a_deviation_is_named_with_its_values_and_a_bound_may_be_met() -> None:
    decided, off = (0.0, 0.0), (0.2, -0.2)
    exact = greatest_displacement(ARM, decided, off, LEVERS)
    arm_alone = replace(POLICY, base_variable=None)
    for bound, rule in ((exact, None), (nextafter(exact, 0.0), "decided-path")):
        policy = replace(arm_alone, tracking=Tracking("off", Fraction(bound), (Fraction(1),) * 2))
        one = tracked(TURN, policy=policy)
        assert one.deviation is None
        assert one.violation(5.0, {"q": off}) == rule
    unmet = UnmetBound("distance from the decided path", exact, "at most", nextafter(exact, 0.0), "m")
    assert one.deviation == MotionDeviation("decided-path", (unmet,))


def test_joints_on_the_other_side_of_zero_are_off_the_path() -> None:
    assert first_fault(tracked(TURN), lambda time: (0.0, -turned(time)[1])) == "decided-path"


def test_a_piece_with_points_of_several_lengths_is_followed_by_no_joints() -> None:
    ((first, second, third, fourth),) = TURN.joint_paths[0]
    ragged = replace(TURN, joint_paths=(((first, second, third, (*fourth, 0.0)),),))
    assert first_fault(tracked(ragged), turned) == "input:q"


def test_two_motions_are_followed_together_and_what_has_ended_stays() -> None:
    assert first_fault(tracked(DRIVE, TURN), turned, driven) is None
    assert first_fault(tracked(TURN, DRIVE), turned, driven) is None
    assert first_fault(tracked(DRIVE, TURN), lambda _: (0.0, 0.0), driven) == "decided-path"
    one = tracked(DRIVE, TURN)
    assert first_fault(one, turned, driven) is None
    one.remove(1)
    assert one.violation(6.5, {"q": (0.0, 0.3), "base": driven(1.5)}) is None
    assert one.violation(6.5, {"q": (0.0, 0.2), "base": driven(1.5)}) == "decided-path"
    idle = [one.is_idle]
    one.remove(0)
    idle.append(one.is_idle)
    assert idle == [False, True]
    assert one.violation(9.0, {}) is None


def test_a_motion_that_is_halted_after_another_has_ended_brakes_before_it_rests() -> None:
    one = tracked(DRIVE, TURN)
    at_start = {"q": (0.0, 0.0), "base": NOWHERE}
    assert one.violation(5.0, at_start) is None
    one.remove(0)
    one.halt(1)
    for angle in (0.1, 0.15, 0.2):
        assert one.violation(5.0, {**at_start, "q": (0.0, angle)}) is None
    one = tracked(DRIVE, TURN)
    one.halt(0)
    for way in (0.1, 0.2):
        assert one.violation(5.0, {**at_start, "base": (way, 0.0, 0.0)}) is None
    one.remove(0)
    assert one.violation(5.0, {**at_start, "base": (0.3, 0.0, 0.0)}) is None
    assert one.violation(5.0, {**at_start, "base": (0.2, 0.0, 0.0)}) == "decided-path"


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
    fast = tracked(replace(TURN, servo=bounds))
    assert first_fault(fast, lambda time: (0.0, 0.3 * time)) == "declared-rates"
    assert isinstance(fast.deviation, MotionDeviation)
    assert fast.deviation.rule == "declared-rates"
    assert str(fast.deviation).startswith("way of joint 2 in 0.0292 s is 0.00875 rad")
    both = tracked(replace(TURN, servo=bounds), replace(DRIVE, servo=replace(bounds, speed=(9.0, 9.0))))
    both.remove(0)  # its bounds with it
    assert first_fault(both, lambda time: (0.0, 0.3 * time), driven) is None


def test_nothing_is_compared_without_a_motion_or_a_bound() -> None:
    idle = MotionTracker(POLICY)
    idle.add(0, NoMotion("it looks"))
    assert idle.is_idle
    idle.halt(0)
    idle.remove(0)
    assert idle.violation(0.0, {}) is None
    assert first_fault(tracked(TURN, policy=replace(POLICY, tracking=None)), lambda _: (9.0, 9.0)) is None
    assert MotionTracker(None).is_idle
