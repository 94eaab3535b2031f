"""Random draws of a trial's plant, and for which other trials they would be the same.

Simulators are deterministic: the same requests and random draws give the same results.  On the symbolic plant
only the outcome of each run of a skill is drawn, so trials of several seeds may share what a plant did; on
physics a seed decides far more, and only trials of that seed may share.
"""

from __future__ import annotations

from typing import Any, Protocol

from aeros.experiments.trial_plants import OpenPlant
from aeros.sim.symbolic.outcomes import DrawEquivalence, OutcomeSampler


class RandomStream(Protocol):
    """Protocol of the random draws of one trial."""

    @property
    def plant_group(self) -> str:
        """Name that is the same for all trials whose plants may be compared."""

    def observed_draws(self, opened: OpenPlant) -> Any:
        """Return the draws that a plant of this trial has made so far.

        Args:
            opened: the open plant.

        Returns:
            The draws, in a form that `reproduces` and `equivalent_interval` of the same class read.
        """

    def reproduces(self, draws: Any) -> bool:
        """Compare this trial's random numbers with another trial's draws.

        Args:
            draws: of a plant that may be compared, from `observed_draws`.

        Returns:
            True if this trial would draw the same.
        """

    def equivalent_interval(self, draws: Any) -> tuple[float, float]:
        """Compute the numbers of the condition with which this seed draws the same.

        Args:
            draws: that this trial has made or reproduced.

        Returns:
            Low and high, both exclusive.
        """


class SeedRandomStream:
    """Draws of a plant that reports between which numbers the same seed does the same, as physics does.

    Args:
        seed: of the trial.
        number: the number that varies between conditions, for instance a rate.
    """

    def __init__(self, seed: int, number: float) -> None:
        self.plant_group = f"seed {seed}"
        self._number = number

    def observed_draws(self, opened: OpenPlant) -> tuple[float, tuple[float, float]]:
        """Implement `RandomStream.observed_draws`.

        Args:
            opened: the open plant.

        Returns:
            The condition's rate, and the open interval of rates for which this seed draws the same; empty,
            as (rate, rate), if the plant reports none.
        """
        return self._number, opened.equivalent_interval() if opened.equivalent_interval else (
            self._number,
            self._number,
        )

    def reproduces(self, draws: tuple[float, tuple[float, float]]) -> bool:
        """Implement `RandomStream.reproduces`."""
        number, (low, high) = draws
        return self._number == number or low < self._number < high

    def equivalent_interval(self, draws: tuple[float, tuple[float, float]]) -> tuple[float, float]:
        """Implement `RandomStream.equivalent_interval`."""
        return draws[1]


class OutcomeRandomStream:
    """Draws of a plant on which only outcomes of skills are drawn, as on the symbolic one.

    Args:
        seed: of the trial.
        draws: sampler of outcomes, with the trial's seed and its condition's number.
        equivalence: the numbers that draw the same outcomes of the skill that fails.
    """

    plant_group = "draws"

    def __init__(self, seed: int, draws: OutcomeSampler, equivalence: DrawEquivalence) -> None:
        self._seed = seed
        self._draws = draws
        self._equivalence = equivalence

    def observed_draws(self, opened: OpenPlant) -> Any:
        """Implement `RandomStream.observed_draws`: the outcomes, in order."""
        assert opened.equivalent_interval is not None  # noqa: S101  a symbolic plant's
        return opened.equivalent_interval()

    def reproduces(self, draws: Any) -> bool:
        """Implement `RandomStream.reproduces`."""
        outcome = self._draws.outcome
        return all(outcome(skill, run).id == had for skill, run, had in draws)

    def equivalent_interval(self, draws: Any) -> tuple[float, float]:
        """Implement `RandomStream.equivalent_interval`."""
        name = self._equivalence.skill
        return self._equivalence.equivalent_interval(self._seed, sum(one.skill == name for one in draws))
