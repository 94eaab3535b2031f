"""Failure of a plan or of a part of it, and what an attempt makes of it."""

from __future__ import annotations

import json
from dataclasses import dataclass, field

from aeros.agent.execution.attempt import AttemptResult
from aeros.agent.execution.waiting import Wait
from aeros.agent.planning.task_graph import PlanStep
from aeros.agent.world.values import to_json_value
from aeros.spec.model.cause import Cause


@dataclass(frozen=True, slots=True)
class PlanFailure:
    """The reason that a plan, or a step, went no further.

    Attributes:
        reason: reason in words.
        is_final: planning again cannot help.
        wait: what may change so that planning again helps later; None if nothing is waited for.
        pause_s: time that is to pass before another plan, plant seconds.
        is_declared: a step ended as it declares that it may, or could not start.
        is_stop: a step was cancelled, or not started, because a part around it was stopped.
        causes: the values behind predicates by definition that decide no branch, as data.
    """

    reason: str
    is_final: bool = False
    wait: Wait | None = None
    pause_s: float = 0.0
    is_declared: bool = field(default=False, compare=False)
    is_stop: bool = field(default=False, compare=False)
    causes: tuple[Cause, ...] = ()


def failure_of_attempt(step: PlanStep, attempt: AttemptResult, denied: set[str]) -> PlanFailure:
    """Return the failure of a step; note a denied request, as its second denial is final.

    Args:
        step: the step.
        attempt: its last attempt, which failed.
        denied: requests that were denied before, as JSON text; receives this one.

    Returns:
        The failure.
    """
    if attempt.is_composed:
        return PlanFailure(
            attempt.reason,
            attempt.ends_run,
            attempt.wait,
            attempt.pause_s,
            is_declared=attempt.is_retryable,
            is_stop=attempt.is_stop,
        )
    ran_by = step if attempt.record is None else attempt.record  # a capability may be of another module
    name = f"`{ran_by.module}.{ran_by.skill}`"
    if attempt.is_halted:
        return PlanFailure(f"{name} was stopped: {attempt.reason}", is_final=True)
    if attempt.ends_run:
        return PlanFailure(f"{name} {attempt.final_words}: {attempt.reason}", is_final=True)
    if not attempt.is_denied:
        ran = attempt.record is not None
        return PlanFailure(
            f"{name} failed: {attempt.reason}",
            wait=attempt.wait,
            pause_s=attempt.pause_s,
            is_declared=attempt.is_retryable or not ran,
            is_stop=attempt.is_stop,
        )
    why = attempt.reason.removeprefix("denied: ")
    if attempt.is_transient:
        return PlanFailure(f"{name} was denied: {why}", wait=attempt.wait)
    inputs = {key: to_json_value(value) for key, value in step.inputs.items()}
    request = json.dumps([ran_by.module, ran_by.skill, inputs], sort_keys=True)
    if request in denied:
        return PlanFailure(f"{name} was denied a second time: {why}", is_final=True)
    denied.add(request)
    return PlanFailure(f"{name} was denied: {why}")


def result_of_composition(end: PlanFailure | None) -> AttemptResult:
    """Return the result of an attempt that ran a composition to its end.

    Args:
        end: failure of the composition; None if it succeeded.

    Returns:
        The result.
    """
    if end is None:
        return AttemptResult(failed=False, reason="", is_composed=True)
    return AttemptResult(
        True,
        end.reason,
        is_retryable=end.is_declared,
        is_stop=end.is_stop,
        ends_run=end.is_final,
        is_composed=True,
        pause_s=end.pause_s,
        wait=end.wait,
    )


def undecided_failure(text: str, why: str, causes: tuple[Cause, ...]) -> PlanFailure:
    """Return the failure of an `if` that has no part to go on with.

    Args:
        text: its condition.
        why: why the condition is not met.
        causes: the values behind predicates by definition, as data.

    Returns:
        The failure, which no alternative follows.
    """
    reason = f"the plan does not say how to continue if `{text}` is not met: {why}"
    return PlanFailure(reason, causes=causes)
