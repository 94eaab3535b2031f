"""The flat pipeline: a fixed sequence of skills, run once."""

from __future__ import annotations

from aeros.experiments.architecture import Means, Told


class FlatPipeline:
    """Runs the steps of the plan made at the start, each once, and ends with the first that fails."""

    def pursue(self, means: Means) -> Told:
        """See `Architecture`."""
        for step in means.plan():
            judged = means.run(step)
            if judged.failed:
                return Told(reason=f"{step.skill}: {judged.reason}")
        return Told()
