"""Execute a plan's graph: parts in sequence, in parallel, by condition and instead of others, with retries.

- An attempt of a step: the skill is active, its precondition is measured as true, it is started. It succeeds
  iff the skill ran to its end and the measured outcome is declared and no failure.
- A failed attempt is repeated at most `retry` times. Before each further attempt `between_tries` runs. Its
  effect is checked by the next attempt's precondition; in a composition its failure fails the step. If the
  step's `unless` is measured as true by then, the step is done. Never repeated: an attempt that did not
  start, was refused, denied or cancelled, or ended in an undeclared outcome.
- When no attempt is left, or the next one cannot start, the step has failed. Then `on_failure` runs, which
  may bring about a state in which the next plan succeeds. It does not run after an attempt that was refused,
  denied or cancelled, or ended in an undeclared outcome. If `between_tries` or `on_failure` itself ends like
  that, so does its step.
- Remaining attempts are dropped if memory makes another one hopeless (`posterior.py`) and this run has
  already planned in the same measured state. The proof of the task's rules counts every failed attempt as one
  that may be the last.
- A step that names a capability runs one of its alternatives. If that is a composition, an attempt is a run
  of it, which fails where a step of it fails for good.
- A sequence fails with its first part that fails. The branches of a `par` start in the order written.
  When one fails for good the whole `par` has failed and nothing follows (as in `flow.paths`): the other
  branches start nothing more and their running steps are cancelled. The `par` ends when they have ended.
- An alternative of a fallback, or another try of a part, follows a declared failure (`alternatives`).
- A part under a held condition or with a timeout is stopped and fails once that breaks (`part_stops`).
- Once the goal is reached nothing more starts; running steps end by themselves.

- An input may use an output of a step that has succeeded; if that output is missing, the step fails.
- A plan whose `progress` says that parts of it were run before continues where it was.

A branch is a generator that yields while one of its steps runs and is sent every step that ends.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from functools import partial
from math import inf
from typing import Any, Final, TypeAlias

from aeros.agent.execution.alternatives import run_alternatives
from aeros.agent.execution.attempt import AttemptResult, RunningAttempt
from aeros.agent.execution.dispatcher import ChosenComposition
from aeros.agent.execution.journal import Journal
from aeros.agent.execution.part_stops import (
    PartStops,
    PlanFailure,
    StopScope,
    failure_of_attempt,
    result_of_composition,
    run_stoppable,
    undecided_failure,
    worse_failure,
)
from aeros.agent.execution.progress import PlanProgress, StepPath, UnfinishedAttempt
from aeros.agent.execution.report import StepRole
from aeros.agent.execution.step_attempt import StepRunner
from aeros.agent.planning.compositions import chosen_composition
from aeros.agent.planning.task_graph import Part, PlanStep
from aeros.agent.world.definitions import unmet_with_definitions
from aeros.runtime.ports import EndedStep
from aeros.spec.model.step_graph import (
    FailingPart,
    Fallback,
    If,
    Par,
    RetriedPart,
    Seq,
    StoppablePart,
)

_AFTER_LAST: Final = 0
"""Place of what follows the last attempt of a step; what runs between two has the number of the first."""

_Branch = Generator[None, EndedStep, PlanFailure | None]
"""Rest of a part's execution; returns None once the part is done, else the failure that ended it."""

_Scope: TypeAlias = StopScope

_OVER: Final = "the time limit of the task has passed"
_CANCELLED: Final = "the client cancelled the task"


class PlanExecutor:
    """Executor of all plans of one run.

    Attributes:
        until: plant time (s) after which everything is cancelled.
        timed_out: True if that time has passed.
        denied: requests that the gate denied for good, as JSON text.
    """

    def __init__(
        self,
        attempts: StepRunner,
        journal: Journal,
        is_goal_reached: Callable[[], bool],
        deadline: float = inf,
    ) -> None:
        self._attempts = attempts
        self._journal = journal
        self._is_over = is_goal_reached
        self._stops = PartStops(attempts, is_goal_reached)
        self.until = deadline
        self.timed_out, self.denied = False, set[str]()
        self._progress = PlanProgress()
        self._outputs: dict[str, Mapping[str, Any]] = {}

    def run(self, part: Part, progress: PlanProgress | None = None) -> PlanFailure | None:
        """Execute a plan until it is done, fails, or the goal is reached.

        Args:
            part: body of the plan.
            progress: progress of an earlier execution of it, which is kept up to date; None for a new plan.

        Returns:
            None if the plan is done or the goal is reached, else the failure that ended it.
        """
        self._outputs.clear()
        self._progress = progress or PlanProgress()
        scope = StopScope()
        branch, until = self._run_part(part, scope, (), StepRole.STEP), self.until
        ended = None
        while True:
            try:
                _resume_branch(branch, ended)
            except StopIteration as done:
                end: PlanFailure | None = done.value
                return end
            while (ended := self._stops.wait(scope, until)) is None:
                until, self.timed_out = inf, not self._attempts.waiting.was_cancelled
                self._stops.cancel(scope, _OVER if self.timed_out else _CANCELLED)

    # Parts.

    def _run_part(self, part: Part, scope: _Scope, path: StepPath, role: StepRole) -> _Branch:
        """Run a part; `role` is that of the first try of each of its steps."""
        match part:
            case PlanStep():
                return self._run_step(part, scope, path, role)
            case Seq(parts=parts):
                return self._run_sequence(parts, scope, path, role)
            case Par(branches=branches):
                return self._run_parallel(branches, scope, path, role)
            case If():
                return self._run_conditional(part, scope, path, role)
            case Fallback(parts=parts):
                return self._run_alternatives([(one, role) for one in parts], scope, path)
            case RetriedPart(part=one, retry=retry):
                return self._run_alternatives([(one, role), *[(one, StepRole.RETRY)] * retry], scope, path)
            case StoppablePart():
                return self._run_stoppable(part, scope, path, role)
            case FailingPart(text=text):
                return self._fail_at_once(text)

    def _run_sequence(self, parts: tuple[Part, ...], scope: _Scope, at: StepPath, role: StepRole) -> _Branch:
        for number, part in enumerate(parts):
            end = yield from self._run_part(part, scope, (*at, number), role)
            if end is not None:
                return end
        return None

    def _run_conditional(self, part: If[PlanStep], scope: _Scope, at: StepPath, role: StepRole) -> _Branch:
        if self._is_over():
            return None
        holds = self._progress.branch_choices.get(at)
        if holds is None:
            holds = self._attempts.world.evaluate(part.condition)
            if holds is not None:
                self._progress.set_branch(at, holds)
        if holds is True:
            return (yield from self._run_part(part.then, scope, (*at, 0), role))
        if holds is False and part.otherwise is not None:
            return (yield from self._run_part(part.otherwise, scope, (*at, 1), role))
        world, modules = self._attempts.world, self._attempts.active_modules()
        return undecided_failure(part.text, *unmet_with_definitions(world, part.condition, modules))

    def _run_alternatives(
        self, parts: Sequence[tuple[Part, StepRole]], scope: _Scope, at: StepPath
    ) -> _Branch:
        starts = [
            partial(self._run_part, part, scope, (*at, number), role)
            for number, (part, role) in enumerate(parts)
        ]
        return run_alternatives(starts, at, self._progress, lambda: scope.cancel_reason is not None)

    def _fail_at_once(self, text: str) -> _Branch:
        yield from ()
        return None if self._is_over() else PlanFailure(f"`{text}` is not met", is_declared=True)

    def _run_stoppable(
        self, part: StoppablePart[PlanStep], scope: _Scope, at: StepPath, role: StepRole
    ) -> _Branch:
        inner = StopScope(scope, cancel_reason=scope.cancel_reason)
        failure = self._stops.begin(part, inner, at, self._progress)
        if failure is None:
            start = partial(self._run_part, part.part, inner, (*at, 0), role)
            failure = yield from run_stoppable(inner, start)
        if failure is None:
            self._progress.mark_done(at)
        return failure

    def _run_parallel(self, parts: tuple[Part, ...], scope: _Scope, at: StepPath, role: StepRole) -> _Branch:
        inner = StopScope(scope, cancel_reason=scope.cancel_reason)
        scope.children.append(inner)
        running = [self._run_part(part, inner, (*at, number), role) for number, part in enumerate(parts)]
        failure: PlanFailure | None = None
        ended: EndedStep | None = None
        while running:
            for branch in list(running):
                try:
                    _resume_branch(branch, ended)
                except StopIteration as done:
                    running.remove(branch)
                    first, failure = failure, worse_failure(failure, done.value)
                    if first is None and failure is not None:
                        self._stops.cancel(inner, f"a parallel branch failed: {failure.reason}")
            if running:
                ended = yield
        scope.children.remove(inner)
        return failure

    # Steps.

    def _run_step(self, step: PlanStep, scope: _Scope, at: StepPath, role: StepRole) -> _Branch:
        if self._progress.is_done(at):
            self._store_outputs(step, self._progress.last_result(at))
            return None
        if self._is_over():
            return None
        if self._is_redundant(step):
            self._journal.record("step-skipped", f"{step} is no longer needed", step=str(step))
            self._progress.mark_done(at)
            return None
        return (yield from self._run_attempt(role, step, scope, at))

    def _run_attempt(self, role: StepRole, step: PlanStep, scope: _Scope, at: StepPath) -> _Branch:
        attempt = self._progress.last_result(at)
        if attempt is None or self._progress.alternative(at):
            attempt = yield from self._invoke(role, step, scope, at)
        has_failed = attempt.is_retryable
        while self._progress.attempt_count(at) <= step.retry:
            if not attempt.is_retryable or attempt.ends_run or self._is_done(step):
                break
            if attempt.no_retry_reason and self._attempts.has_planned_in_current_state():
                why = attempt.no_retry_reason
                self._journal.record("retries-skipped", f"{step}: {why}", step=str(step), reason=why)
                break
            count = self._progress.attempt_count(at)
            end = yield from self._run_recovery(step.between_tries, scope, (*at, count))
            if end is not None and (step.needs_recovery or not end.is_declared):
                return (yield from self._fail(step, end, scope, at))
            if self._is_done(step):
                self._progress.mark_done(at)
                return None
            attempt = yield from self._invoke(StepRole.RETRY, step, scope, at)
            did_not_start = attempt.record is None and not attempt.is_composed
            has_failed = attempt.is_retryable or (has_failed and did_not_start)
        if not attempt.failed or (attempt.is_retryable and self._is_done(step)):
            self._progress.mark_done(at)
            return None
        failure = failure_of_attempt(step, attempt, self.denied)
        return (yield from self._fail(step, failure, scope, at)) if has_failed else failure

    def _fail(self, step: PlanStep, failure: PlanFailure, scope: _Scope, at: StepPath) -> _Branch:
        """Run what follows the last attempt of a step; return the failure of the step."""
        if not failure.is_declared or self._is_over():
            return failure
        end = yield from self._run_recovery(step.on_failure, scope, (*at, _AFTER_LAST))
        return failure if end is None or end.is_declared else end

    def _run_recovery(self, recovery: PlanStep | None, scope: _Scope, at: StepPath) -> _Branch:
        """Run a recovery, if there is one that was not run yet."""
        if recovery is None or self._progress.is_done(at):
            return None
        return (yield from self._run_attempt(StepRole.RECOVERY, recovery, scope, at))

    def _invoke(
        self, role: StepRole, step: PlanStep, scope: _Scope, at: StepPath
    ) -> Generator[None, EndedStep, AttemptResult]:
        self._stops.before_step(scope)
        if scope.cancel_reason is not None:
            return AttemptResult(failed=True, reason=f"cancelled: {scope.cancel_reason}", is_stop=True)
        if self._progress.alternative(at):
            return (yield from self._run_composition(role, step, scope, at))
        inputs = _filled_inputs(step, self._outputs)
        if isinstance(inputs, str):
            return AttemptResult(failed=True, reason=inputs)
        before, head = self._attempts.world.predicates, self._attempts.audit_head
        self._progress.start_attempt(at, UnfinishedAttempt(step.module, step.skill, inputs, before, head))
        started = self._attempts.start(role, step.module, step.skill, inputs, scope.held)
        if isinstance(started, ChosenComposition):
            self._progress.choose_alternative(at, started.name)
            return (yield from self._run_composition(role, step, scope, at))
        if not isinstance(started, RunningAttempt):
            self._progress.drop_attempt(at)
            return started
        scope.running.add(started.handle)
        while True:
            ended = yield
            if ended.step == started.handle:
                scope.running.remove(started.handle)
                attempt = self._attempts.finish(started.pending, ended.result)
                self._progress.finish_attempt(at, attempt)
                self._store_outputs(step, attempt)
                self._stops.after_step(scope, ended.result)
                return attempt

    def _run_composition(
        self, role: StepRole, step: PlanStep, scope: _Scope, at: StepPath
    ) -> Generator[None, EndedStep, AttemptResult]:
        """Run the composition that was chosen for a step, or what is left of it, as one attempt."""
        count, chosen = self._progress.attempt_count(at), self._progress.alternative(at)
        body = chosen_composition(self._attempts.active_modules(), step.module, step.skill, chosen)
        if body is None:
            attempt = AttemptResult(failed=True, reason=f"`{chosen}` is no longer there", is_composed=True)
        else:
            first = role if count == 1 else StepRole.RETRY
            end = yield from self._run_part(body, scope, (*at, -count), first)
            attempt = result_of_composition(end)
        if not attempt.ends_run:  # else a resumed run goes on inside it
            self._progress.finish_attempt(at, attempt)
        return attempt

    def _store_outputs(self, step: PlanStep, attempt: AttemptResult | None) -> None:
        if attempt is not None and not attempt.failed:
            self._outputs[step.id] = attempt.outputs

    def _is_done(self, step: PlanStep) -> bool:
        return self._is_over() or self._is_redundant(step)

    def _is_redundant(self, step: PlanStep) -> bool:
        return step.unless is not None and self._attempts.world.truth_by_known_values(step.unless) is True


def _filled_inputs(step: PlanStep, outputs: Mapping[str, Mapping[str, Any]]) -> dict[str, Any] | str:
    """Return the inputs of a step with outputs of earlier steps, or the reason that one is missing."""
    inputs = dict(step.inputs)
    for name, (source, output) in step.flows.items():
        if output not in outputs.get(source, {}):
            return f"its input `{name}` takes `{source}.{output}`, which is missing"
        inputs[name] = outputs[source][output]
    return inputs


def _resume_branch(branch: _Branch, ended: EndedStep | None) -> None:
    """Start a branch, or send it the step that has ended; raises `StopIteration` once the branch is done."""
    if ended is None:
        next(branch)
    else:
        branch.send(ended)
