"""Failures and stops of parts of a plan: of branches of a `par`, under held conditions, and within times.

A held part fails once its condition is not measured as true: at its beginning, at a control tick while a step
of it runs (the runtime decides that), and after each of its steps, the last one included.  A part with a
timeout fails once its time has passed.  The outermost part that fails is stopped: its running steps are
cancelled, and nothing in it starts any more.  Its failure is a declared one, unless a step of it ended in a
way that no plan provides for.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass, field
from math import inf
from typing import TYPE_CHECKING

from aeros.agent.execution.attempt import AttemptResult
from aeros.agent.execution.progress import PlanProgress, StepPath
from aeros.agent.execution.waiting import Wait
from aeros.agent.planning.task_graph import PlanStep
from aeros.agent.world.values import to_json_value
from aeros.runtime.ports import EndedStep, StepHandle, StepResult
from aeros.spec.model.cause import Cause
from aeros.spec.model.ecm import ActionCondition
from aeros.spec.model.step_graph import HeldPart, StoppablePart, TimedPart

if TYPE_CHECKING:
    from aeros.agent.execution.step_attempt import StepRunner


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

    The first is final if it was denied in several ways, between which the skill looked again.

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
    if attempt.is_exhausted:
        return PlanFailure(f"{name} was denied in every way that it knows: {why}", is_final=True)
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


@dataclass(eq=False)
class StopScope:
    """Parts that are stopped together, and the scopes inside them.

    Attributes:
        parent: the scope around this one; None for a whole plan.
        condition: condition that is held; None if there is none.
        deadline: plant time (s) at which the time of the part has passed.
        cancel_reason: why nothing in this scope may start any more; None if it may.
        stop: the failure with which the part of this scope was stopped; None if it was not.
        running: steps that are running.
        children: scopes inside.
    """

    parent: StopScope | None = None
    condition: ActionCondition | None = None
    deadline: float = inf
    cancel_reason: str | None = None
    stop: PlanFailure | None = None
    running: set[StepHandle] = field(default_factory=set)
    children: list[StopScope] = field(default_factory=list)

    def cancel(self, reason: str) -> Iterator[StepHandle]:
        """Forbid further starts in this scope and yield its running steps.

        Args:
            reason: the reason in words.

        Yields:
            The steps that are to be cancelled.
        """
        self.cancel_reason = self.cancel_reason or reason
        yield from sorted(self.running)
        for scope in self.children:
            yield from scope.cancel(reason)

    @property
    def around(self) -> list[StopScope]:
        """This scope and those around it, the outermost first."""
        return [*([] if self.parent is None else self.parent.around), self]

    @property
    def held(self) -> tuple[ActionCondition, ...]:
        """Conditions that are held for a step in this scope, the outermost first."""
        return tuple(one.condition for one in self.around if one.condition is not None)

    def is_due_to_stop(
        self, holds: Callable[[ActionCondition], bool], is_past: Callable[[float], bool]
    ) -> bool:
        """Tell if the part of this scope has to stop.

        Args:
            holds: tells whether a condition is measured as true.
            is_past: tells whether a deadline (plant seconds) has passed.

        Returns:
            True if its condition does not hold, or its time has passed.
        """
        return is_past(self.deadline) or not (self.condition is None or holds(self.condition))

    def scope_to_stop(
        self,
        holds: Callable[[ActionCondition], bool],
        is_past: Callable[[float], bool],
        lost_hold: int | None = None,
    ) -> StopScope | None:
        """Find the outermost scope around a step that has to stop.

        Args:
            holds: tells whether a condition is measured as true.
            is_past: tells whether a deadline (plant seconds) has passed.
            lost_hold: position in `held` of a condition that was lost while the step ran; None if none was.

        Returns:
            The scope; None if none has to stop.
        """
        number = 0
        for scope in self.around:
            if scope.stop is None and scope.is_due_to_stop(holds, is_past):
                return scope
            if scope.condition is not None:
                if number == lost_hold:
                    return scope
                number += 1
        return None

    def running_deadlines(self) -> Iterator[StopScope]:
        """Find the scopes, of this one and those inside, whose time has still to pass.

        Yields:
            Each scope before those inside it.
        """
        if self.cancel_reason is None:
            if self.deadline < inf:
                yield self
            for scope in self.children:
                yield from scope.running_deadlines()


def run_stoppable(
    scope: StopScope, start: Callable[[], Generator[None, EndedStep, PlanFailure | None]]
) -> Generator[None, EndedStep, PlanFailure | None]:
    """Run the part of a scope until it ends or is stopped.

    Args:
        scope: the scope, whose parent is the scope around the part.
        start: starts the part.

    Returns:
        None if the part has succeeded; else its failure: that of its stop, unless a step ended in a way
        that no plan provides for.
    """
    around = scope.parent
    if around is not None:
        around.children.append(scope)
    failure = yield from start()
    if around is not None:
        around.children.remove(scope)
    if scope.stop is not None and (failure is None or failure.is_declared or failure.is_stop):
        return scope.stop
    return failure


def worse_failure(first: PlanFailure | None, second: PlanFailure | None) -> PlanFailure | None:
    """Choose the failure of parallel branches that decides what follows.

    Args:
        first: failure of the branches that ended before; None if all of them succeeded.
        second: failure of the branch that ended last; None if it succeeded.

    Returns:
        The first failure, unless the second ends the run, or the first is that of a stop and the second is
        one that no plan provides for.
    """
    if first is None or second is None:
        return second if first is None else first
    is_unprovided = first.is_stop and not (second.is_declared or second.is_stop)
    return second if is_unprovided or (second.is_final and not first.is_final) else first


class PartStops:
    """Stops of the parts of one run's plans.

    Args:
        attempts: measures, waits and cancels.
        is_over: tells whether the goal is reached, after which no part fails any more.
    """

    def __init__(self, attempts: StepRunner, is_over: Callable[[], bool]) -> None:
        self._attempts = attempts
        self._is_over = is_over

    def begin(
        self, part: StoppablePart[PlanStep], scope: StopScope, at: StepPath, progress: PlanProgress
    ) -> PlanFailure | None:
        """Begin a part, unless its condition does not hold or its time has passed already.

        A part that is done is not held any more: a resumed plan passes through it for its outputs.

        Args:
            part: the part.
            scope: its scope, which gets the condition or the deadline.
            at: step path of the part.
            progress: progress of the plan, which keeps the time at which a part began.

        Returns:
            The failure if it does not begin; None if it does.
        """
        if self._is_over() or progress.is_done(at):
            return None
        if isinstance(part, HeldPart):
            scope.condition = part.condition
        elif isinstance(part, TimedPart):
            scope.deadline = progress.begin_part(at, self._attempts.waiting.now) + float(part.timeout)
        if scope.cancel_reason is None and scope.is_due_to_stop(self._holds, self._is_due):
            return self._failure(scope)
        return None

    def before_step(self, scope: StopScope) -> None:
        """Stop the outermost part around a step that is about to start whose time has passed.

        Args:
            scope: scope of the step.
        """
        if scope.cancel_reason is None and not self._is_over():
            late = scope.scope_to_stop(lambda _: True, self._is_due)
            if late is not None:
                self._stop(late)

    def after_step(self, scope: StopScope, result: StepResult) -> None:
        """Stop the outermost part around a step that has ended whose condition or time broke.

        Args:
            scope: scope of the step.
            result: result of the step, after which the world was measured.
        """
        if not self._is_over():
            broken = scope.scope_to_stop(self._holds, self._is_past, result.lost_hold)
            if broken is not None:
                self._stop(broken, "" if result.lost_hold is None else result.reason)

    def wait(self, scope: StopScope, until: float) -> EndedStep | None:
        """Wait for a step to end, and stop the parts whose time passes meanwhile.

        Args:
            scope: scope of the whole plan.
            until: plant time at which the time of the task has passed, s.

        Returns:
            The step; None if the task's time has passed, or the client has cancelled the task.
        """
        waiting = self._attempts.waiting
        while True:
            timed, was_cancelled = list(scope.running_deadlines()), waiting.was_cancelled
            due = min([until, *(one.deadline for one in timed)])
            ended = self._attempts.wait(due)
            if ended is not None or waiting.was_cancelled is not was_cancelled:
                return ended
            # A plant with a fixed step may end a wait up to a step early.
            now = max(due, waiting.now)
            if now >= until or not timed:
                return None
            for one in timed:
                if one.deadline <= now and one.stop is None:
                    self._stop(one)

    def cancel(self, scope: StopScope, reason: str) -> None:
        """Cancel the running steps of a scope; nothing in it starts any more.

        Args:
            scope: the scope.
            reason: the reason for the audit record.
        """
        for handle in scope.cancel(reason):
            self._attempts.cancel(handle, reason)

    def _stop(self, scope: StopScope, why: str = "") -> None:
        scope.stop = self._failure(scope, why)
        self.cancel(scope, scope.stop.reason)

    def _failure(self, scope: StopScope, why: str = "") -> PlanFailure:
        if scope.condition is None:
            return PlanFailure("the time of this part has passed", is_declared=True)
        why = why or self._attempts.world.unmet_reason(scope.condition.term)
        return PlanFailure(f"`{scope.condition.text}` is not held: {why}", is_declared=True)

    def _holds(self, condition: ActionCondition) -> bool:
        return self._attempts.world.evaluate(condition.term) is True

    def _is_due(self, deadline: float) -> bool:
        return self._attempts.waiting.now >= deadline

    def _is_past(self, deadline: float) -> bool:
        return self._attempts.waiting.now > deadline
