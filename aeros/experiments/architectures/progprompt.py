"""ProgPrompt-style execution: step by step, with a full new plan where a step fails.

After the paper's table of baseline faithfulness (`tab:faithfulness`): sequential execution, checks of the
world's state in place of assertions, full-plan regeneration on failure, and planning rules in place of a
language model, so that planners are alike over all architectures.
"""

from __future__ import annotations

from aeros.experiments.architecture import ArchitectureReport, TrialContext


class ProgPrompt:
    """Planner that follows each plan to its first failure, and then plans again from what is measured.

    Args:
        max_plans: most plans in all; the paper's k, read as it is for the behaviour tree: the number of
            attempts.
    """

    def __init__(self, max_plans: int = 3) -> None:
        self._max_plans = max_plans

    def pursue(self, context: TrialContext) -> ArchitectureReport:
        """Implement `Architecture.pursue`."""
        reason = ""
        for made in range(self._max_plans):
            reason = _run_plan(context)
            if context.is_goal_reached():
                return ArchitectureReport(replans=made)
        return ArchitectureReport(replans=self._max_plans - 1, reason=reason)


def _run_plan(context: TrialContext) -> str:
    """Make a plan and follow it to its end or first failure; return why it went no further."""
    for step in context.plan():
        # The assertion before the step: its effect may hold already.
        if step.unless is not None and context.world().truth_by_known_values(step.unless) is True:
            continue
        assessment = context.run(step)
        if assessment.failed:
            return f"{step.skill}: {assessment.reason}"
    return "the plan is finished but the goal is not reached"
