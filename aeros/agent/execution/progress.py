"""How far a plan has come: which tries of which steps were begun, and how each ended.

A place is where in the plan's graph a part is: the numbers of the parts on the way down to it, and, of what
helps between two tries, the number of the try before it.  Nothing here decides anything; the engine asks
it where to go on, and checkpoints keep it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from aeros.agent.execution.step_attempt import AttemptResult
from aeros.runtime.ports import LogHead

StepPath = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class UnfinishedAttempt:
    """A try whose end nobody has acknowledged.

    skill: or the capability, where the step names one.
    before: the predicates as they were measured when it began.
    head: where the audit record ended then.
    """

    module: str
    skill: str
    inputs: Mapping[str, Any]
    before: Mapping[str, Any]
    head: LogHead


@dataclass
class AttemptHistory:
    """What has been tried at one place.

    tries: how many were begun.
    begun: the one under way, if there is one.
    last: how the last one ended, if it has.
    """

    attempt_count: int = 0
    unfinished: UnfinishedAttempt | None = None
    last_result: AttemptResult | None = None


@dataclass
class PlanProgress:
    """Of one plan.

    settled: places at which nothing is left to do.
    branches: at each `if` that was decided, whether `then` is followed.
    changed: called after what a resumed agent must know of has changed.
    """

    attempts: dict[StepPath, AttemptHistory] = field(default_factory=dict)
    done_paths: set[StepPath] = field(default_factory=set)
    branch_choices: dict[StepPath, bool] = field(default_factory=dict)
    on_change: Callable[[], None] = lambda: None

    def attempt_count(self, at: StepPath) -> int:
        """How many tries were begun at that place."""
        return self.attempts[at].attempt_count if at in self.attempts else 0

    def last_result(self, at: StepPath) -> AttemptResult | None:
        """How the last try ended there; None where there was none."""
        return self.attempts[at].last_result if at in self.attempts else None

    def is_done(self, at: StepPath) -> bool:
        """Whether nothing is left to do there."""
        last = self.last_result(at)
        return at in self.done_paths or (last is not None and not last.failed)

    def mark_done(self, at: StepPath) -> None:
        """Nothing is left to do there."""
        self.done_paths.add(at)

    def start_attempt(self, at: StepPath, begun: UnfinishedAttempt) -> None:
        """A try is about to begin."""
        tried = self.attempts.setdefault(at, AttemptHistory())
        tried.attempt_count, tried.unfinished, tried.last_result = tried.attempt_count + 1, begun, None
        self.on_change()

    def finish_attempt(self, at: StepPath, how: AttemptResult) -> None:
        """It has ended; but one that was stopped from outside has only been left."""
        if not how.is_halted:
            self.attempts[at].unfinished, self.attempts[at].last_result = None, how
            self.on_change()

    def drop_attempt(self, at: StepPath) -> None:
        """It was never begun."""
        tried = self.attempts[at]
        tried.attempt_count, tried.unfinished = tried.attempt_count - 1, None

    def set_branch(self, at: StepPath, then: bool) -> None:
        """An `if` was decided."""
        self.branch_choices[at] = then
        self.on_change()

    def unfinished_attempts(self) -> list[tuple[StepPath, UnfinishedAttempt]]:
        """What was begun and not acknowledged, in the order of places."""
        return [
            (at, one.unfinished) for at, one in sorted(self.attempts.items()) if one.unfinished is not None
        ]
