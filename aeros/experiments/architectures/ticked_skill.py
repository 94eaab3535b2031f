"""A skill as a leaf of a tree: it runs over many ticks, and is halted if the tree goes elsewhere."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from aeros.agent.execution.supervisor import StepAssessment
from aeros.agent.planning.task_graph import PlanStep
from aeros.experiments.architecture import ArchitectureReport, RunningStep, TrialContext
from aeros.spec.expr.terms import Term

_TICK_S: Final = 0.5
"""Time between two ticks while a skill runs, s; a tree ticks faster, but perceives no more often."""


def is_measured_true(context: TrialContext, term: Term) -> bool:
    """Tell if a condition is measured as true; a leaf of a tree that reads it takes unknown as false.

    Args:
        context: of the trial.
        term: the condition.

    Returns:
        True if the values that are known make it true.
    """
    return context.world().truth_by_known_values(term) is True


@dataclass
class TreeCounters:
    """Counters of what a tree did besides first attempts.

    Attributes:
        starts: starts of the whole tree.
        retries: further attempts of skills.
        recoveries: runs of skills that help.
        reason: reason of the last failure.
    """

    starts: int = 0
    retries: int = 0
    recoveries: int = 0
    reason: str = ""

    def report(self, *, is_success: bool) -> ArchitectureReport:
        """Report the work of the tree.

        Args:
            is_success: True if its root succeeded.

        Returns:
            The report, with each start after the first as a re-plan.
        """
        reason = "" if is_success else self.reason
        return ArchitectureReport(self.retries, self.recoveries, max(0, self.starts - 1), reason)


class TickedSkill:
    """A skill that is ticked.

    Args:
        context: of the trial.
        step: the skill and its inputs.
        counters: of the tree.
        is_recovery: True if it helps another skill: it never fails, as the next attempt shows if it helped.
    """

    def __init__(
        self, context: TrialContext, step: PlanStep, counters: TreeCounters, *, is_recovery: bool = False
    ) -> None:
        self._context, self._step, self._counters = context, step, counters
        self._is_recovery = is_recovery
        self._running: RunningStep | None = None
        self._is_tried = False

    def tick(self) -> bool | None:
        """Begin the skill if it is not under way, and let it run for one tick.

        Returns:
            True if it succeeded, False if it failed; None if it is still under way.
        """
        if self._running is None:
            self._counters.recoveries += self._is_recovery
            self._counters.retries += self._is_tried and not self._is_recovery
            self._is_tried = True
            started = self._context.begin(self._step)
            if isinstance(started, StepAssessment):
                return self._is_success(started)
            self._running = started
        ended = self._running.wait(_TICK_S)
        if ended is None:
            return None
        self._running = None
        return self._is_success(ended)

    def halt(self) -> None:
        """Halt the skill if it is under way."""
        if self._running is not None:
            self._running.halt()
            self._running = None

    def _is_success(self, assessment: StepAssessment) -> bool:
        if assessment.failed and not self._is_recovery:
            self._counters.reason = f"{self._step.skill}: {assessment.reason}"
        return self._is_recovery or not assessment.failed
