"""What chance does to the plant of a trial, and to which other trials it would have done the same.

A plant does the same whenever the same is asked of it and chance does the same.  On the symbolic plant all
that chance does is the outcome of each run of a skill, so trials of several seeds may share what a plant did;
on physics a seed decides far more, and only trials of that seed may.
"""

from __future__ import annotations

from typing import Any, Protocol

from aeros.experiments.trial_plants import OpenPlant
from aeros.sim.symbolic.outcomes import DrawEquivalence, OutcomeSampler


class RandomStream(Protocol):
    """The chance of one trial.

    shared: names whose plants may be compared with its own.
    """

    @property
    def plant_group(self) -> str:
        """See `RandomStream`."""

    def observed_draws(self, opened: OpenPlant) -> Any:
        """What chance has done so far to a plant of its own."""

    def reproduces(self, draws: Any) -> bool:
        """Whether it would have done what it was `seen` to do to a plant that may be compared."""

    def equivalent_interval(self, seen: Any) -> tuple[float, float]:
        """Numbers of the condition, exclusive, with which its seed would do the same, once it has done so."""


class SeedRandomStream:
    """Where all that is known is between which numbers the same seed does the same: `OpenPlant.equivalent_interval`.

    number: the condition's: a rate, say.
    """

    def __init__(self, seed: int, number: float) -> None:
        self.plant_group = f"seed {seed}"
        self._number = number

    def observed_draws(self, opened: OpenPlant) -> tuple[float, tuple[float, float]]:
        """Its number, and those between which all would be the same; none where the plant does not say."""
        return self._number, opened.equivalent_interval() if opened.equivalent_interval else (
            self._number,
            self._number,
        )

    def reproduces(self, seen: tuple[float, tuple[float, float]]) -> bool:
        """See `RandomStream`."""
        number, (low, high) = seen
        return self._number == number or low < self._number < high

    def equivalent_interval(self, seen: tuple[float, tuple[float, float]]) -> tuple[float, float]:
        """See `RandomStream`."""
        return seen[1]


class OutcomeRandomStream:
    """Where outcomes of skills are drawn and nothing else is: `OpenPlant.equivalent_interval` tells which were.

    draws: of the trial's seed, at its condition's number.
    drawing: what else would draw the same of the skill that fails.
    """

    plant_group = "draws"

    def __init__(self, seed: int, draws: OutcomeSampler, drawing: DrawEquivalence) -> None:
        self._seed = seed
        self._draws = draws
        self._drawing = drawing

    def observed_draws(self, opened: OpenPlant) -> Any:
        """See `RandomStream`."""
        assert opened.equivalent_interval is not None  # noqa: S101  a symbolic plant's
        return opened.equivalent_interval()

    def reproduces(self, seen: Any) -> bool:
        """See `RandomStream`."""
        outcome = self._draws.outcome
        return all(outcome(skill, run).id == had for skill, run, had in seen)

    def equivalent_interval(self, seen: Any) -> tuple[float, float]:
        """See `RandomStream`."""
        name = self._drawing.skill
        return self._drawing.equivalent_interval(self._seed, sum(one.skill == name for one in seen))
