"""Checks of what happens before a motion: plans, beginnings and refusals."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from math import dist, inf, isfinite, nan
from typing import Any, Final

from aeros.runtime.ports import MotionCompletion, NoMotion, Trajectory
from aeros.sim.conformance.plant_under_test import (
    ConformanceError,
    PlantUnderTest,
    RecordingMonitor,
    begin_motion,
    require,
    require_unchanged,
    values_of,
    wait_for_end,
)
from aeros.skill import Action


def planning_moves_nothing(subject: PlantUnderTest) -> None:
    """Check that `plan` changes no measured value, neither at once nor after some time.

    Args:
        subject: the plant under test.

    Raises:
        ConformanceError: the plant breaks this promise.
    """
    with subject.plant() as plant:
        before = values_of(plant.observe())
        for _ in range(2):
            plan = plant.plan(subject.motion_action)
            require(
                isinstance(plan, Trajectory | NoMotion),
                f"it cannot plan `{subject.motion_action.kind}`: {plan}",
            )
        require_unchanged(subject, before, values_of(plant.observe()), "after `plan`")
        wait_for_end(plant, begin_motion(plant, subject.parallel_action), RecordingMonitor())
        require_unchanged(
            subject, before, values_of(plant.observe()), "some time after `plan`, nothing begun"
        )


def a_planned_motion_begins_where_the_robot_is(subject: PlantUnderTest) -> None:
    """Check that a `Trajectory` has a duration, connected pieces, and starts at the measured joints.

    Args:
        subject: the plant under test.

    Raises:
        ConformanceError: the plant breaks this promise.
    """
    with subject.plant() as plant:
        measured = values_of(plant.observe())
        plan = plant.plan(subject.motion_action)
    if isinstance(plan, NoMotion):
        require(bool(plan.reason), "it reports that an action moves nothing, but gives no reason")
        return
    require(isinstance(plan, Trajectory), f"it cannot plan `{subject.motion_action.kind}`: {plan}")
    assert isinstance(plan, Trajectory)  # noqa: S101  for the type checker
    require(isfinite(plan.duration) and plan.duration > 0.0, f"a motion takes {plan.duration} s")
    require(all(plan.joint_paths) and bool(plan.joint_paths), "a motion has a path without pieces")
    for path in plan.joint_paths:
        joins = pairwise(path)
        require(all(dist(a[3], b[0]) < 1e-9 for a, b in joins), "the pieces of a path do not join")
    away = max(
        abs(a - b) for a, b in zip(plan.joint_paths[0][0][0], measured[subject.joint_variable], strict=True)
    )
    require(
        away <= subject.tracking_tolerance,
        f"a planned motion begins {away} rad or m from where the joints are",
    )


def nothing_moves_before_time_goes_on(subject: PlantUnderTest) -> None:
    """Check that `begin` changes no measured value before `advance`.

    Args:
        subject: the plant under test.

    Raises:
        ConformanceError: the plant breaks this promise.
    """
    with subject.plant() as plant:
        before = values_of(plant.observe())
        begin_motion(plant, subject.motion_action)
        require_unchanged(subject, before, values_of(plant.observe()), "after `begin`")


def a_stale_plan_is_refused(subject: PlantUnderTest) -> None:
    """Check that `begin` refuses a plan that was made in another state.

    A plan that moves nothing is valid everywhere.

    Args:
        subject: the plant under test.

    Raises:
        ConformanceError: the plant breaks this promise.
    """
    with subject.plant() as plant:
        stale = plant.plan(subject.motion_action)
        wait_for_end(plant, begin_motion(plant, subject.motion_action), RecordingMonitor())
        before = values_of(plant.observe())
        begin = plant.begin(subject.motion_action, stale)
        if isinstance(stale, NoMotion):
            return
        require(
            isinstance(begin, MotionCompletion), "a plan that starts where the robot no longer is was begun"
        )
        _require_reason(begin, "a stale plan")
        require_unchanged(subject, before, values_of(plant.observe()), "after a refusal")


def invalid_input_is_rejected_with_a_reason_before_any_motion(subject: PlantUnderTest) -> None:
    """Check that `plan` and `begin` refuse invalid actions with a reason and do not raise.

    Invalid are unknown kinds, missing and unknown parameters, and values of the wrong type, form or size.
    The plant still does valid actions afterwards.

    Args:
        subject: the plant under test.

    Raises:
        ConformanceError: the plant breaks this promise.
    """
    with subject.plant() as plant:
        before = values_of(plant.observe())
        for what, action in invalid_actions(subject):
            for ask in (plant.plan, plant.begin):
                try:
                    answer = ask(action)
                except Exception as error:
                    raise ConformanceError(f"{what} makes it raise {error!r}") from error
                _require_reason(answer, what)
        require_unchanged(subject, before, values_of(plant.observe()), "after bad input")
        over = wait_for_end(plant, begin_motion(plant, subject.motion_action), RecordingMonitor())
        require(over.completed, f"after bad input it fails at a valid action: {over.reason}")


def _require_reason(answer: object, what: str) -> None:
    require(isinstance(answer, MotionCompletion), f"{what} is not refused: {answer!r}")
    assert isinstance(answer, MotionCompletion)  # noqa: S101  for the type checker
    has_reason = isinstance(answer.reason, str) and bool(answer.reason.strip())
    require(not answer.completed and has_reason, f"{what} is refused without a reason: {answer}")
    require(
        not str(answer.reason).startswith("monitor:"), f"{what} is refused as if by the monitor: {answer}"
    )


def invalid_actions(subject: PlantUnderTest) -> Iterator[tuple[str, Action]]:
    """Yield actions that no plant can do, as mutants of valid ones.

    Args:
        subject: the plant under test, whose actions are mutated.

    Yields:
        What is wrong, and the action.
    """
    yield "an unknown kind", Action("no such kind", {})
    for kind, parameters in (subject.motion_action, subject.parallel_action):
        yield "an unknown parameter", Action(kind, {**parameters, "no_such_parameter": 1.0})
        for name, value in parameters.items():
            less = {other: kept for other, kept in parameters.items() if other != name}
            yield f"`{kind}` without `{name}`", Action(kind, less)
            for bad in _invalid_values(value):
                yield f"`{kind}` with `{name}` = {bad!r:.40}", Action(kind, {**parameters, name: bad})


_INVALID_NUMBERS: Final[tuple[Any, ...]] = (nan, inf, -inf, 10**400, True, None, "1", (), (1.0,), {})
"""Values that are not finite numbers."""

_NON_NUMBERS: Final[tuple[Any, ...]] = (None, nan, 1.0, (), "no such word")
"""Values that are neither a known word nor a vector."""


def _invalid_values(value: Any) -> Iterator[Any]:
    """Yield values that are not of the type or form of `value`."""
    if isinstance(value, tuple):
        yield from (*_NON_NUMBERS, value[:-1], (*value, 0.0))
        for index in range(len(value)):
            yield from ((*value[:index], bad, *value[index + 1 :]) for bad in _INVALID_NUMBERS)
    elif isinstance(value, str):
        yield from _NON_NUMBERS
    else:
        yield from _INVALID_NUMBERS
