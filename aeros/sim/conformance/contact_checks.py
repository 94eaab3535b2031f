"""Checks of motions in contact, and of arm and base moving together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from math import dist
from typing import Any, Final

from aeros.kinematic_chain import frames_of, mounting_of
from aeros.runtime.ports import JointVector, MotionCompletion, MotionHandle, Plant, ServoBounds, Trajectory
from aeros.sim.conformance.motion_checks import expected_position, path_point
from aeros.sim.conformance.plant_under_test import (
    MONITOR_RULE,
    MOTION_TIMEOUT_S,
    PlantUnderTest,
    RecordingMonitor,
    begin_motion,
    require,
    require_every_tick,
    require_heeded_at_once,
    require_unchanged,
    values_of,
    wait_for_end,
)

_SAMPLES: Final = 16
"""Samples of each piece of a planned path."""

_WINDOW_TICKS: Final = 12
_TOOL_TOLERANCE: Final = 0.003
"""Ticks over which the tool's way in contact is compared with its declared speed, and the allowance, m."""

_START_DELAY_S: Final = 0.2
"""Delay of the arm's motion after the base's, s."""


def a_servo_motion_stays_near_its_paths(subject: PlantUnderTest) -> None:
    """Check that a move in contact keeps to the paths and speeds that its plan states.

    Args:
        subject: the plant under test.

    Raises:
        ConformanceError: the plant breaks this promise.
    """
    if not subject.contact_actions:
        return
    with subject.plant() as plant:
        plan, motion, servo = _begin_contact(subject, plant)
        watch = RecordingMonitor()
        over = wait_for_end(plant, motion, watch)
        require(over.completed, f"the last of `contact_actions` was not completed: {over.reason}")
    seen = watch.history(subject.joint_variable)
    points = _path_points(plan)
    near = points[0]
    for joints in seen:
        # The point near the joints a tick ago is mostly near them still; all are looked at before it fails.
        away = _max_excess(joints, near, servo.joint_tolerance)
        if away > subject.tracking_tolerance:
            away, near = min((_max_excess(joints, point, servo.joint_tolerance), point) for point in points)
        require(
            away <= subject.tracking_tolerance, f"in contact a joint is {away:.4f} rad or m beyond its slack"
        )
    if subject.period is None:
        return
    for before, after in pairwise(seen):
        for a, b, limit in zip(before, after, servo.speed, strict=True):
            speed = abs(b - a) / subject.period
            require(
                speed <= limit + subject.max_overshoot, f"in contact a joint reaches {speed:.4f} rad/s or m/s"
            )
    mountings = [mounting_of(row) for row in plan.body.dh_rows]
    tools = [frames_of(mountings, joints)[-1].to_base(plan.body.tool_offset) for joints in seen]
    for start, end in zip(tools, tools[_WINDOW_TICKS:], strict=False):
        most = servo.tool_speed * _WINDOW_TICKS * subject.period + _TOOL_TOLERANCE
        require(dist(start, end) <= most, "in contact the tool is faster than the plan states")


def a_broken_rule_stops_contact_within_one_tick(subject: PlantUnderTest) -> None:
    """Check that a rule broken while the robot presses on something stops it as from anywhere else.

    Args:
        subject: the plant under test.

    Raises:
        ConformanceError: the plant breaks this promise.
    """
    if not subject.contact_actions:
        return
    with subject.plant() as plant:
        _, motion, _ = _begin_contact(subject, plant)
        start = plant.now()
        require(
            wait_for_end(plant, motion, RecordingMonitor()).completed,
            "the last of `contact_actions` was not completed",
        )
        lasts = plant.now() - start
    watches = []
    for delay in (0.0, subject.tick):
        with subject.plant() as plant:
            _, motion, _ = _begin_contact(subject, plant)
            watches.append(_stop_midway(subject, plant, [motion], 0.8 * lasts + delay))
    if subject.period is not None and subject.repeats:
        require_heeded_at_once(*watches)


def motions_of_arm_and_base_together_are_each_as_decided(subject: PlantUnderTest) -> None:
    """Check that an arm and a base that move together each follow their own plan.

    Args:
        subject: the plant under test.

    Raises:
        ConformanceError: the plant breaks this promise.
    """
    if not subject.parallel_actions:
        return
    with subject.plant() as plant:
        watch, since, plans, motions = RecordingMonitor(), plant.now(), [], []
        for action in subject.parallel_actions:
            plan = plant.plan(action)
            require(
                isinstance(plan, Trajectory),
                f"`{action.kind}` of `parallel_actions` is not a trajectory: {plan}",
            )
            assert isinstance(plan, Trajectory)  # noqa: S101  for the type checker
            plans.append((plan, plant.now()))
            motions.append(_begin_planned(plant, action, plan))
            if len(motions) == 1:
                require(
                    plant.advance(watch, since + _START_DELAY_S) == {}, "the base ended before the arm began"
                )
        over = _advance_until_all_end(plant, motions, watch)
    for motion, how in over.items():
        require(how.completed, f"{motion} of {motions} together was not completed: {how.reason}")
    (drive, drove), (reach, reached) = plans
    for time, values in watch.seen:
        _, base = expected_position(drive, _path_share(drive, time - drove))
        off = dist(values[subject.base_variable], base)
        require(
            off <= subject.tracking_tolerance, f"{time - drove:.3f} s on, the base is {off:.4f} m off its way"
        )
        joints, _ = expected_position(reach, _path_share(reach, time - reached))
        away = max(abs(a - b) for a, b in zip(values[subject.joint_variable], joints, strict=True))
        require(
            away <= subject.tracking_tolerance,
            f"{time - reached:.3f} s on, a joint is {away:.4f} rad or m off",
        )


def a_broken_rule_stops_arm_and_base(subject: PlantUnderTest) -> None:
    """Check that a rule broken while arm and base move ends both within one tick and brings both to rest.

    Args:
        subject: the plant under test.

    Raises:
        ConformanceError: the plant breaks this promise.
    """
    if not subject.parallel_actions:
        return
    with subject.plant() as plant:
        motions = [begin_motion(plant, subject.parallel_actions[0])]
        require(
            plant.advance(RecordingMonitor(), plant.now() + _START_DELAY_S) == {},
            "the base ended before the arm began",
        )
        motions.append(begin_motion(plant, subject.parallel_actions[1]))
        _stop_midway(subject, plant, motions, _START_DELAY_S)


def _begin_contact(subject: PlantUnderTest, plant: Plant) -> tuple[Trajectory, MotionHandle, ServoBounds]:
    """Begin the last of `contact_actions` after the others; return its plan, handle and servo bounds."""
    *before, action = subject.contact_actions
    for earlier in before:
        over = wait_for_end(plant, begin_motion(plant, earlier), RecordingMonitor())
        require(over.completed, f"`{earlier.kind}`, on the way to contact, was not completed: {over.reason}")
    plan = plant.plan(action)
    servo = plan.servo if isinstance(plan, Trajectory) else None
    require(
        servo is not None, f"`{action.kind}`, the last of `contact_actions`, is not under feedback: {plan}"
    )
    assert isinstance(plan, Trajectory)  # noqa: S101  for the type checker
    assert servo is not None  # noqa: S101  for the type checker
    return plan, _begin_planned(plant, action, plan), servo


def _begin_planned(plant: Plant, action: Any, plan: Trajectory) -> MotionHandle:
    motion = plant.begin(action, plan)
    require(
        not isinstance(motion, MotionCompletion),
        f"it cannot begin the motion that it has just planned: {motion}",
    )
    assert not isinstance(motion, MotionCompletion)  # noqa: S101  for the type checker
    return motion


def _advance_until_all_end(
    plant: Plant, motions: Sequence[MotionHandle], watch: RecordingMonitor
) -> Mapping[MotionHandle, MotionCompletion]:
    over: dict[MotionHandle, MotionCompletion] = {}
    latest = plant.now() + MOTION_TIMEOUT_S
    while len(over) < len(motions):
        require(plant.now() < latest, f"{motions} have not ended after {MOTION_TIMEOUT_S:g} s")
        over.update(plant.advance(watch, latest))
    return over


def _stop_midway(
    subject: PlantUnderTest, plant: Plant, motions: Sequence[MotionHandle], after: float
) -> RecordingMonitor:
    watch = RecordingMonitor(rule_time=plant.now() + after)
    over = plant.advance(watch, plant.now() + MOTION_TIMEOUT_S)
    expected = dict.fromkeys(motions, MotionCompletion(False, f"monitor:{MONITOR_RULE}"))
    require(over == expected, f"the monitor named a rule while {motions} were under way; {over} ended")
    named = [time for time, _ in watch.seen if time >= watch.rule_time]
    require_every_tick(subject, named, plant.now())
    took = plant.now() - named[0]
    require(took <= subject.max_stop_time + 2 * subject.tick, f"the stop took {took:.3f} s")
    before = values_of(plant.observe())
    require(
        plant.advance(RecordingMonitor(), plant.now() + 0.2) == {}, "a motion ends that had already ended"
    )
    require_unchanged(subject, before, values_of(plant.observe()), "after both came to rest")
    return watch


def _path_share(plan: Trajectory, since: float) -> float:
    return max(0.0, min(1.0, since / plan.duration))


def _path_points(plan: Trajectory) -> list[Sequence[float]]:
    """Sample every path of a plan."""
    return [
        path_point(path, number / (_SAMPLES * len(path)))
        for path in plan.joint_paths
        for number in range(_SAMPLES * len(path) + 1)
    ]


def _max_excess(joints: JointVector, stated: Sequence[float], slack: JointVector) -> float:
    """Return by how much the farthest joint is beyond its tolerance around a point, rad."""
    return max(abs(a - b) - s for a, b, s in zip(joints, stated, slack, strict=True))
