"""Runs a plan's graph: its parts in sequence, in parallel and by condition, each step tried and tried again.

- A try of a step: the skill is active, its precondition is measured as true, it is started.  It succeeds
  iff the skill ran to its end and the outcome that is measured is declared and no failure.
- A failed try is repeated at most `retry` times.  Before each further try `on_failure` runs (with default
  inputs; whether that does any good is left to the next try's precondition), or the step's handler,
  whose own failure is the step's.  Where the step's `unless` is by then measured, the step is done.
  Never repeated: a try that did not start, was refused, denied or cancelled, or ended in an undeclared
  outcome.  An `on_failure` that was submitted and refused, denied, or ended in an undeclared outcome ends
  its step likewise.
- Tries that are left are forgone where memory makes a further one hopeless (`posterior.py`) and this run
  has planned before in a world measured as now: it will plan again there, and in no state that the proof
  of the task's rules does not know as one to plan in.
- A sequence fails with the first part that fails.  The branches of a `par` start in the order written.
  When one fails for good, the whole has failed and nothing follows (as `flow.paths` takes it): the
  others start nothing more, and what they have under way is cancelled.  It has ended once that has.
- Once the goal is measured nothing more starts; what is under way ends by itself.

- An input may take an output of a step that has succeeded; where that gave none, the step fails.
- A plan of which `progress` says that parts of it were run before goes on where it was.

A branch is a generator that yields while a step of it is under way and is sent every step that ends.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Generator, Iterator, Mapping
from dataclasses import dataclass, field
from math import inf
from typing import Any

from aeros.agent.execution.journal import Journal
from aeros.agent.execution.progress import Begun, Place, Progress
from aeros.agent.execution.report import Role
from aeros.agent.execution.step_attempt import Attempt, Attempts, Started
from aeros.agent.planning.task_graph import Part, Step
from aeros.agent.world.values import plain
from aeros.runtime.ports import Ended, StepHandle
from aeros.spec.model.step_graph import If, Par, Seq


@dataclass(frozen=True, slots=True)
class End:
    """Why a plan, or a step, went no further.

    final: planning again is no use.
    may_pass: it is no use now, and may be later.
    """

    reason: str
    final: bool = False
    may_pass: bool = False


_Branch = Generator[None, Ended, End | None]
"""What is left of a part: returns None once it is done, else how it failed for good."""


@dataclass
class _Scope:
    """Branches that are cancelled together, and those inside them.

    cancelled: why nothing of it may start any more.
    """

    cancelled: str | None = None
    under_way: set[StepHandle] = field(default_factory=set)
    inner: list[_Scope] = field(default_factory=list)

    def cancel(self, reason: str) -> Iterator[StepHandle]:
        """Let nothing start any more; what is under way."""
        self.cancelled = self.cancelled or reason
        yield from sorted(self.under_way)
        for scope in self.inner:
            yield from scope.cancel(reason)


class Engine:
    """Runs the plans of one run.

    until: plant seconds after which everything is cancelled; is_late: whether that has come to pass.
    """

    def __init__(
        self, attempts: Attempts, journal: Journal, is_over: Callable[[], bool], until: float = inf
    ) -> None:
        self._attempts = attempts
        self._journal = journal
        self._is_over = is_over
        self.until = until
        self.denied: set[str] = set()
        self._progress = Progress()
        self._outputs: dict[str, Mapping[str, Any]] = {}
        self.is_late = False

    def run(self, part: Part, progress: Progress | None = None) -> End | None:
        """None once all of it is done or the goal is measured, else how it failed for good.

        progress: how far it has come before, kept up to date.
        """
        self._outputs.clear()
        self._progress = progress or Progress()
        scope = _Scope()
        branch, until = self._part(part, scope, ()), self.until
        ended = None
        while True:
            try:
                _go_on(branch, ended)
            except StopIteration as done:
                end: End | None = done.value
                return end
            while (ended := self._attempts.wait(until)) is None:
                until, self.is_late = inf, True
                self._cancel(scope, "the time for the task is over")

    # Parts.

    def _part(self, part: Part, scope: _Scope, at: Place) -> _Branch:
        match part:
            case Step():
                return self._step(part, scope, at)
            case Seq(parts=parts):
                return self._seq(parts, scope, at)
            case Par(branches=branches):
                return self._par(branches, scope, at)
            case If():
                return self._if(part, scope, at)

    def _seq(self, parts: tuple[Part, ...], scope: _Scope, at: Place) -> _Branch:
        for number, part in enumerate(parts):
            end = yield from self._part(part, scope, (*at, number))
            if end is not None:
                return end
        return None

    def _if(self, part: If[Step], scope: _Scope, at: Place) -> _Branch:
        if self._is_over():
            return None
        holds = self._progress.branches.get(at)
        if holds is None:
            holds = self._attempts.world.evaluate(part.condition)
            if holds is not None:
                self._progress.choose(at, holds)
        if holds is True:
            return (yield from self._part(part.then, scope, (*at, 0)))
        if holds is False and part.otherwise is not None:
            return (yield from self._part(part.otherwise, scope, (*at, 1)))
        why = self._attempts.world.why_not(part.condition)
        return End(f"nothing is said of what follows where `{part.text}` is not measured: {why}")

    def _par(self, parts: tuple[Part, ...], scope: _Scope, at: Place) -> _Branch:
        inner = _Scope(scope.cancelled)
        scope.inner.append(inner)
        running = [self._part(part, inner, (*at, number)) for number, part in enumerate(parts)]
        failure: End | None = None
        ended: Ended | None = None
        while running:
            for branch in list(running):
                try:
                    _go_on(branch, ended)
                except StopIteration as done:
                    running.remove(branch)
                    if done.value is not None and failure is None:
                        failure = done.value
                        self._cancel(inner, f"beside it, {failure.reason}")
            if running:
                ended = yield
        scope.inner.remove(inner)
        return failure

    def _cancel(self, scope: _Scope, reason: str) -> None:
        for handle in scope.cancel(reason):
            self._attempts.cancel(handle, reason)

    # Steps.

    def _step(self, step: Step, scope: _Scope, at: Place) -> _Branch:
        if self._progress.is_done(at):
            self._keep_outputs(step, self._progress.last(at))
            return None
        if self._is_over():
            return None
        if self._is_needless(step):
            self._journal.tell("step-left-out", f"{step} is not needed any more", step=str(step))
            self._progress.settle(at)
            return None
        return (yield from self._try(Role.STEP, step, scope, at))

    def _try(self, role: Role, step: Step, scope: _Scope, at: Place) -> _Branch:
        attempt = self._progress.last(at) or (yield from self._invoke(role, step, scope, at))
        while self._progress.tries(at) <= step.retry:
            if not attempt.repeatable or self._is_done(step):
                break
            if attempt.hopeless and self._attempts.is_as_planned():
                why = attempt.hopeless
                self._journal.tell("tries-forgone", f"{step}: {why}", step=str(step), reason=why)
                break
            end = yield from self._recover(step, scope, (*at, self._progress.tries(at)))
            if end is not None:
                return end
            if self._is_done(step):
                self._progress.settle(at)
                return None
            attempt = yield from self._invoke(Role.RETRY, step, scope, at)
        if not attempt.failed or (attempt.repeatable and self._is_done(step)):
            self._progress.settle(at)
            return None
        return self._end_of(step, attempt)

    def _recover(self, step: Step, scope: _Scope, at: Place) -> _Branch:
        """Run what helps between two tries; how the step ends if what came of that forbids another."""
        if self._progress.is_done(at):
            return None
        if step.handler is not None:
            return (yield from self._try(Role.RECOVERY, step.handler, scope, at))
        if step.on_failure is None:
            return None
        recovery = Step(step.module, step.on_failure)
        attempt = self._progress.last(at) or (yield from self._invoke(Role.RECOVERY, recovery, scope, at))
        # Not started is no obstacle: nothing moved, and the next try checks its own precondition.
        if not attempt.failed or attempt.repeatable or attempt.record is None:
            return None
        return self._end_of(recovery, attempt)

    def _invoke(self, role: Role, step: Step, scope: _Scope, at: Place) -> Generator[None, Ended, Attempt]:
        if scope.cancelled is not None:
            return Attempt(failed=True, reason=f"cancelled: {scope.cancelled}")
        inputs = dict(step.inputs)
        for name, (source, output) in step.flows.items():
            if output not in self._outputs.get(source, {}):
                why = f"its input `{name}` takes `{source}.{output}`, which is not there"
                return Attempt(failed=True, reason=why)
            inputs[name] = self._outputs[source][output]
        before, head = self._attempts.world.predicates, self._attempts.head
        self._progress.begin(at, Begun(step.module, step.skill, inputs, before, head))
        begun = self._attempts.begin(role, step.module, step.skill, inputs)
        if not isinstance(begun, Started):
            self._progress.withdraw(at)
            return begun
        scope.under_way.add(begun.handle)
        while True:
            ended = yield
            if ended.step == begun.handle:
                scope.under_way.remove(begun.handle)
                attempt = self._attempts.conclude(begun.made, ended.result)
                self._progress.conclude(at, attempt)
                self._keep_outputs(step, attempt)
                return attempt

    def _keep_outputs(self, step: Step, attempt: Attempt | None) -> None:
        if attempt is not None and not attempt.failed:
            self._outputs[step.id] = attempt.outputs

    def _end_of(self, step: Step, attempt: Attempt) -> End:
        skill = step.skill if attempt.record is None else attempt.record.skill
        name = f"`{step.module}.{skill}`"
        if attempt.halted:
            return End(f"{name} was stopped: {attempt.reason}", final=True)
        if attempt.stops:
            return End(f"{name} came to what it does not declare: {attempt.reason}", final=True)
        if not attempt.denied:
            return End(f"{name} failed: {attempt.reason}")
        if attempt.may_pass:
            return End(f"{name} was denied: {attempt.reason}", may_pass=True)
        inputs = {key: plain(value) for key, value in step.inputs.items()}
        request = json.dumps([step.module, skill, inputs], sort_keys=True)
        if request in self.denied:
            return End(f"{name} was denied a second time: {attempt.reason}", final=True)
        self.denied.add(request)
        return End(f"{name} was denied: {attempt.reason}")

    def _is_done(self, step: Step) -> bool:
        return self._is_over() or self._is_needless(step)

    def _is_needless(self, step: Step) -> bool:
        return step.unless is not None and self._attempts.world.evaluate(step.unless) is True


def _go_on(branch: _Branch, ended: Ended | None) -> None:
    """Let a branch look at what has ended, or begin; raises `StopIteration` once it is done."""
    if ended is None:
        next(branch)
    else:
        branch.send(ended)
