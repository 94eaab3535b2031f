"""Alternatives of a plan's part, one after the other: the parts of a fallback, and the tries of a part.

The next one runs only after the one before has ended in a failure that it declares: an outcome that is a
failure, or a step that could not start.  After a refusal, a denial, an undeclared outcome or a cancellation
an assumption of the plan is wrong, so the whole part fails.  Which alternatives have failed is kept with the
plan's progress, so a resumed plan goes on with the one that was next.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from typing import Protocol, TypeVar

from aeros.agent.execution.progress import PlanProgress, StepPath
from aeros.runtime.ports import EndedStep


class AlternativeFailure(Protocol):
    """The reason that an alternative has failed."""

    @property
    def is_declared(self) -> bool:
        """True if a step ended as it declares that it may, or could not start."""
        ...


F = TypeVar("F", bound=AlternativeFailure)


def run_alternatives(
    alternatives: Sequence[Callable[[], Generator[None, EndedStep, F | None]]],
    at: StepPath,
    progress: PlanProgress,
    is_cancelled: Callable[[], bool],
) -> Generator[None, EndedStep, F | None]:
    """Run alternatives until one of them succeeds.

    Args:
        alternatives: start each of them, in their order; at least one.
        at: step path of the part that consists of them.
        progress: progress of the plan, which says which of them have failed before.
        is_cancelled: tells whether nothing may start any more.

    Returns:
        None if one has succeeded, else the failure of the last one that ran.
    """
    failure: F | None = None
    last = len(alternatives) - 1
    for number, start in enumerate(alternatives):
        if failure is not None:
            if not failure.is_declared or is_cancelled():
                return failure
            progress.mark_failed(at, number - 1)
        if number < last and progress.has_failed(at, number):
            continue
        failure = yield from start()
        if failure is None:
            return None
    return failure
