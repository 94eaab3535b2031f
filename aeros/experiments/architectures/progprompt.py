"""ProgPrompt-style execution: step by step, and the full plan made anew where a step fails.

After the paper's table of baseline faithfulness (`tab:faithfulness`): sequential execution, checks of the
world's state in place of assertions, full-plan regeneration on failure, and planning rules in place of a
language model, so that planners are alike over all architectures.
"""

from __future__ import annotations

from aeros.experiments.architecture import ArchitectureReport, TrialContext


class ProgPrompt:
    """Makes at most `max_plans` plans, each from what is measured then, and follows each to its first failure.

    plans: the paper's k, taken as it is for the behaviour tree: so many attempts in all.
    """

    def __init__(self, max_plans: int = 3) -> None:
        self._plans = max_plans

    def pursue(self, means: TrialContext) -> ArchitectureReport:
        """See `Architecture`."""
        reason = ""
        for made in range(self._plans):
            reason = _run_plan(means)
            if means.is_goal_reached():
                return ArchitectureReport(replans=made)
        return ArchitectureReport(replans=self._plans - 1, reason=reason)


def _run_plan(means: TrialContext) -> str:
    """Follow a new plan; why it went no further."""
    for step in means.plan():
        # The assertion before the step: what it is for may hold already.
        if step.unless is not None and means.world().evaluate(step.unless) is True:
            continue
        judged = means.run(step)
        if judged.failed:
            return f"{step.skill}: {judged.reason}"
    return "the plan is exhausted, and the goal is not measured"
