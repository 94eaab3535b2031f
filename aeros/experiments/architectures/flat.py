"""The flat pipeline: a fixed sequence of skills, run once."""

from __future__ import annotations

from aeros.experiments.architecture import ArchitectureReport, TrialContext


class FlatPipeline:
    """Pipeline that runs each step of its first plan once, and ends with the first that fails."""

    def pursue(self, context: TrialContext) -> ArchitectureReport:
        """Implement `Architecture.pursue`."""
        for step in context.plan():
            assessment = context.run(step)
            if assessment.failed:
                return ArchitectureReport(reason=f"{step.skill}: {assessment.reason}")
        return ArchitectureReport()
