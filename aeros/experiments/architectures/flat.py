"""The flat pipeline: a fixed sequence of skills, run once."""

from __future__ import annotations

from aeros.experiments.architecture import ArchitectureReport, TrialContext


class FlatPipeline:
    """Runs the steps of the plan made at the start, each once, and ends with the first that fails."""

    def pursue(self, means: TrialContext) -> ArchitectureReport:
        """See `Architecture`."""
        for step in means.plan():
            judged = means.run(step)
            if judged.failed:
                return ArchitectureReport(reason=f"{step.skill}: {judged.reason}")
        return ArchitectureReport()
