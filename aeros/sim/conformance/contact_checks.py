"""Checks of motions that are not alone: in contact, under feedback, and of arm and base at the same time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from math import dist
from typing import Any, Final

from aeros.runtime.ports import Completion, Joints, Motion, Plant, Servo, Trajectory
from aeros.sim.conformance.motion_checks import decided_at, point
from aeros.sim.conformance.plant_under_test import (
    PATIENCE,
    RULE,
    Subject,
    Watch,
    begun,
    ended,
    require,
    unchanged,
    values_of,
)

_SAMPLES: Final = 16
"""Of each piece of a stated path."""

_APART: Final = 0.2
"""How long after the base the arm begins, s."""


def a_motion_under_feedback_keeps_near_its_paths(subject: Subject) -> None:
    """A move in contact says which paths it stays near and how fast it may be, and keeps to both."""
    if not subject.pressing:
        return
    with subject.plant() as plant:
        plan, motion, servo = _pressed(subject, plant)
        watch = Watch()
        over = ended(plant, motion, watch)
        require(over.completed, f"the last of `pressing` was not completed: {over.reason}")
    seen = watch.of(subject.joints)
    stated = _stated(plan)
    for joints in seen:
        away = min(_farthest(joints, one, servo.slack) for one in stated)
        require(away <= subject.follows_within, f"in contact a joint is {away:.4f} rad beyond its slack")
    if subject.period is None:
        return
    for before, after in pairwise(seen):
        for a, b, limit in zip(before, after, servo.speed, strict=True):
            speed = abs(b - a) / subject.period
            require(
                speed <= limit + subject.overshoots, f"in contact a joint is as fast as {speed:.4f} rad/s"
            )


def a_rule_named_in_contact_ends_it_within_one_tick(subject: Subject) -> None:
    """A rule that is named while the robot presses on something: it comes to rest as from anywhere."""
    if not subject.pressing:
        return
    with subject.plant() as plant:
        _, motion, _ = _pressed(subject, plant)
        start = plant.now()
        require(ended(plant, motion, Watch()).completed, "the last of `pressing` was not completed")
        lasts = plant.now() - start
    with subject.plant() as plant:
        _, motion, _ = _pressed(subject, plant)
        _named_midway(subject, plant, [motion], 0.8 * lasts)


def motions_of_arm_and_base_together_are_each_as_decided(subject: Subject) -> None:
    """An arm that begins while the base drives makes its own profile, and the base goes on with its own."""
    if not subject.together:
        return
    with subject.plant() as plant:
        watch, since, plans, motions = Watch(), plant.now(), [], []
        for action in subject.together:
            plan = plant.plan(action)
            require(isinstance(plan, Trajectory), f"`{action.kind}` of `together` is no trajectory: {plan}")
            assert isinstance(plan, Trajectory)  # noqa: S101  for the type checker
            plans.append((plan, plant.now()))
            motions.append(_begun_as(plant, action, plan))
            if len(motions) == 1:
                require(plant.advance(watch, since + _APART) == {}, "the base ended before the arm began")
        over = _until_all_ended(plant, motions, watch)
    for motion, how in over.items():
        require(how.completed, f"{motion} of {motions} together was not completed: {how.reason}")
    (drive, drove), (reach, reached) = plans
    for time, values in watch.seen:
        _, base = decided_at(drive, _share(drive, time - drove))
        off = dist(values[subject.base], base)
        require(
            off <= subject.follows_within, f"{time - drove:.3f} s on, the base is {off:.4f} m off its way"
        )
        joints, _ = decided_at(reach, _share(reach, time - reached))
        away = max(abs(a - b) for a, b in zip(values[subject.joints], joints, strict=True))
        require(away <= subject.follows_within, f"{time - reached:.3f} s on, a joint is {away:.4f} rad off")


def a_rule_named_ends_arm_and_base_together(subject: Subject) -> None:
    """A rule that is named while both move: both end, within one tick, and both come to rest."""
    if not subject.together:
        return
    with subject.plant() as plant:
        motions = [begun(plant, subject.together[0])]
        require(plant.advance(Watch(), plant.now() + _APART) == {}, "the base ended before the arm began")
        motions.append(begun(plant, subject.together[1]))
        _named_midway(subject, plant, motions, _APART)


def _pressed(subject: Subject, plant: Plant) -> tuple[Trajectory, Motion, Servo]:
    """The last of `pressing`, begun after the others; its plan and what that says of feedback."""
    *before, action = subject.pressing
    for one in before:
        over = ended(plant, begun(plant, one), Watch())
        require(over.completed, f"`{one.kind}`, on the way to contact, was not completed: {over.reason}")
    plan = plant.plan(action)
    servo = plan.servo if isinstance(plan, Trajectory) else None
    require(servo is not None, f"`{action.kind}`, the last of `pressing`, is not under feedback: {plan}")
    assert isinstance(plan, Trajectory)  # noqa: S101  for the type checker
    assert servo is not None  # noqa: S101  for the type checker
    return plan, _begun_as(plant, action, plan), servo


def _begun_as(plant: Plant, action: Any, plan: Trajectory) -> Motion:
    motion = plant.begin(action, plan)
    require(not isinstance(motion, Completion), f"it cannot begin what it has planned just before: {motion}")
    assert not isinstance(motion, Completion)  # noqa: S101  for the type checker
    return motion


def _until_all_ended(plant: Plant, motions: Sequence[Motion], watch: Watch) -> Mapping[Motion, Completion]:
    over: dict[Motion, Completion] = {}
    latest = plant.now() + PATIENCE
    while len(over) < len(motions):
        require(plant.now() < latest, f"{motions} have not ended after {PATIENCE:g} s")
        over.update(plant.advance(watch, latest))
    return over


def _named_midway(subject: Subject, plant: Plant, motions: Sequence[Motion], after: float) -> None:
    watch = Watch(names=plant.now() + after)
    over = plant.advance(watch, plant.now() + PATIENCE)
    expected = dict.fromkeys(motions, Completion(False, f"monitor:{RULE}"))
    require(over == expected, f"a rule was named while {motions} were under way, and ended were {over}")
    named = [time for time, _ in watch.seen if time >= watch.names]
    require(len(named) == 1, f"after a rule was named the monitor was asked {len(named) - 1} times more")
    took = plant.now() - named[0]
    require(took <= subject.stops_within + 2 * subject.tick, f"coming to rest took {took:.3f} s")
    before = values_of(plant.observe())
    require(plant.advance(Watch(), plant.now() + 0.2) == {}, "something ends that has ended before")
    unchanged(subject, before, values_of(plant.observe()), "after both came to rest")


def _share(plan: Trajectory, since: float) -> float:
    return max(0.0, min(1.0, since / plan.duration))


def _stated(plan: Trajectory) -> list[Sequence[float]]:
    """Points of every path."""
    return [
        point(path, number / (_SAMPLES * len(path)))
        for path in plan.paths
        for number in range(_SAMPLES * len(path) + 1)
    ]


def _farthest(joints: Joints, stated: Sequence[float], slack: Joints) -> float:
    """By how much the joint farthest from a point is beyond its slack, rad."""
    return max(abs(a - b) - s for a, b, s in zip(joints, stated, slack, strict=True))
