"""Scopes of a plan whose steps are stopped together: branches of a `par`, held parts, and parts with a timeout.

A held part fails once its condition is not measured as true: at its beginning, at a control tick while a step
of it runs (the runtime decides that), and after each of its steps, the last one included.  A part with a
timeout fails once its time has passed.  The outermost part that fails is stopped: its running steps are
cancelled, and nothing in it starts any more.  Its failure is a declared one, unless a step of it ended in a
way that no plan provides for.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass, field
from math import inf
from typing import Generic, Protocol, TypeVar

from aeros.runtime.ports import EndedStep, StepHandle
from aeros.spec.model.ecm import ActionCondition


class PartFailure(Protocol):
    """The reason that a part has failed."""

    @property
    def is_declared(self) -> bool:
        """True if a step ended as it declares that it may, or could not start."""
        ...

    @property
    def is_stop(self) -> bool:
        """True if a step was cancelled, or not started, because a scope around it was cancelled."""
        ...


F = TypeVar("F", bound=PartFailure)


@dataclass(eq=False)
class StopScope(Generic[F]):
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

    parent: StopScope[F] | None = None
    condition: ActionCondition | None = None
    deadline: float = inf
    cancel_reason: str | None = None
    stop: F | None = None
    running: set[StepHandle] = field(default_factory=set)
    children: list[StopScope[F]] = field(default_factory=list)

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
    def around(self) -> list[StopScope[F]]:
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
    ) -> StopScope[F] | None:
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

    def running_deadlines(self) -> Iterator[StopScope[F]]:
        """Yield the scopes, of this one and those inside, whose time has still to pass."""
        if self.cancel_reason is None:
            if self.deadline < inf:
                yield self
            for scope in self.children:
                yield from scope.running_deadlines()


def run_stoppable(
    scope: StopScope[F], start: Callable[[], Generator[None, EndedStep, F | None]]
) -> Generator[None, EndedStep, F | None]:
    """Run the part of a scope until it ends or is stopped.

    Args:
        scope: the scope, whose parent is the scope around the part.
        start: starts the part.

    Returns:
        None if the part has succeeded; else its failure: that of the stop, if the part was stopped and no step
        ended in a way that no plan provides for.
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


def worse_failure(first: F | None, second: F | None) -> F | None:
    """Choose the failure of parallel branches that decides what follows.

    Args:
        first: failure of the branches that ended before; None if all of them succeeded.
        second: failure of the branch that ended last; None if it succeeded.

    Returns:
        The first failure, unless it is that of a stop and the second is one that no plan provides for.
    """
    if first is None or second is None:
        return second if first is None else first
    return second if first.is_stop and not (second.is_declared or second.is_stop) else first
