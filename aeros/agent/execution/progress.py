"""Progress of a plan: the attempts of each step that were started, and their results.

A step path is the place of a part in the plan's graph: the indices of the parts on the way down to it. A
recovery between two attempts adds the number of the attempt before it; one after the last attempt adds 0. An
attempt that runs a composition adds its number below 0 to the paths of the parts of that. An alternative of a
fallback, and a try of a part, that has failed has a mark at the path of the whole with its number below 0.
This module decides nothing: the executor asks it where to continue, and checkpoints keep it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from aeros.agent.execution.attempt import AttemptResult
from aeros.runtime.ports import LogHead

StepPath = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class UnfinishedAttempt:
    """An attempt whose end has not been acknowledged.

    Attributes:
        module: id of the module.
        skill: skill, or the capability if the step names one.
        inputs: inputs by name (SI).
        before: predicates as measured when it started.
        head: end of the audit record at that time.
    """

    module: str
    skill: str
    inputs: Mapping[str, Any]
    before: Mapping[str, Any]
    head: LogHead


@dataclass
class AttemptHistory:
    """The attempts at one step path.

    Attributes:
        attempt_count: number of attempts started.
        unfinished: attempt that is running, if any.
        last_result: result of the last attempt that has ended, if any.
        alternative: name of the composition that the running attempt runs; empty if it runs a skill.
    """

    attempt_count: int = 0
    unfinished: UnfinishedAttempt | None = None
    last_result: AttemptResult | None = None
    alternative: str = ""


@dataclass
class PlanProgress:
    """Progress of one plan.

    Attributes:
        attempts: attempts by step path.
        done_paths: step paths where nothing is left to do.
        part_starts: plant time (s) at which each part with a timeout began.
        branch_choices: for each `if` that was decided, True if `then` is followed; False for an alternative
            that has failed.
        on_change: called after a change that a resumed agent must know of.
    """

    attempts: dict[StepPath, AttemptHistory] = field(default_factory=dict)
    done_paths: set[StepPath] = field(default_factory=set)
    branch_choices: dict[StepPath, bool] = field(default_factory=dict)
    part_starts: dict[StepPath, float] = field(default_factory=dict)
    on_change: Callable[[], None] = lambda: None

    def attempt_count(self, at: StepPath) -> int:
        """Count the attempts that were started at a step path.

        Args:
            at: step path.

        Returns:
            The number of attempts, 0 if there were none.
        """
        return self.attempts[at].attempt_count if at in self.attempts else 0

    def last_result(self, at: StepPath) -> AttemptResult | None:
        """Return the result of the last attempt at a step path.

        Args:
            at: step path.

        Returns:
            The result; None if no attempt has ended.
        """
        return self.attempts[at].last_result if at in self.attempts else None

    def is_done(self, at: StepPath) -> bool:
        """Check if nothing is left to do at a step path.

        Args:
            at: step path.

        Returns:
            True if the path was marked as done, or its last attempt succeeded.
        """
        last = self.last_result(at)
        return at in self.done_paths or (last is not None and not last.failed)

    def mark_done(self, at: StepPath) -> None:
        """Mark a step path as done.

        Args:
            at: step path.
        """
        self.done_paths.add(at)

    def start_attempt(self, at: StepPath, attempt: UnfinishedAttempt) -> None:
        """Record that an attempt is about to start.

        Args:
            at: step path.
            attempt: the attempt.
        """
        tried = self.attempts.setdefault(at, AttemptHistory())
        tried.attempt_count, tried.unfinished = tried.attempt_count + 1, attempt
        self.on_change()

    def finish_attempt(self, at: StepPath, result: AttemptResult) -> None:
        """Record the result of the attempt, unless the operator halted it: then it stays unfinished.

        Args:
            at: step path.
            result: result of the attempt.
        """
        if not result.is_halted:
            tried = self.attempts[at]
            tried.unfinished, tried.last_result, tried.alternative = None, result, ""
            self.on_change()

    def alternative(self, at: StepPath) -> str:
        """Return the composition that the running attempt at a step path runs.

        Args:
            at: step path.

        Returns:
            Its name; empty if no attempt runs one.
        """
        return self.attempts[at].alternative if at in self.attempts else ""

    def choose_alternative(self, at: StepPath, name: str) -> None:
        """Record that the attempt that was recorded last runs a composition.

        Args:
            at: step path.
            name: name of the alternative.
        """
        tried = self.attempts[at]
        tried.unfinished, tried.alternative = None, name
        self.on_change()

    def drop_attempt(self, at: StepPath) -> None:
        """Remove the attempt that was recorded last: it never started.

        Args:
            at: step path.
        """
        tried = self.attempts[at]
        tried.attempt_count, tried.unfinished = tried.attempt_count - 1, None

    def set_branch(self, at: StepPath, then: bool) -> None:
        """Record the decision of an `if`.

        Args:
            at: step path of the `if`.
            then: True if `then` is followed, False for `else`.
        """
        self.branch_choices[at] = then
        self.on_change()

    def begin_part(self, at: StepPath, now: float) -> float:
        """Record the start of a part with a timeout, unless it began before.

        Args:
            at: step path of the part.
            now: plant time, s.

        Returns:
            Plant time at which it began, s.
        """
        if at not in self.part_starts:
            self.part_starts[at] = now
            self.on_change()
        return self.part_starts[at]

    def mark_failed(self, at: StepPath, number: int) -> None:
        """Record that an alternative has failed and the next one is due.

        Args:
            at: step path of the part with the alternatives.
            number: number of the alternative, from 0.
        """
        self.set_branch((*at, -1 - number), False)

    def has_failed(self, at: StepPath, number: int) -> bool:
        """Check if an alternative was marked as failed.

        Args:
            at: step path of the part with the alternatives.
            number: number of the alternative, from 0.

        Returns:
            True if it was.
        """
        return (*at, -1 - number) in self.branch_choices

    def unfinished_attempts(self) -> list[tuple[StepPath, UnfinishedAttempt]]:
        """List the attempts that were started and not acknowledged.

        Returns:
            Pairs of step path and attempt, sorted by step path.
        """
        return [
            (at, one.unfinished) for at, one in sorted(self.attempts.items()) if one.unfinished is not None
        ]
