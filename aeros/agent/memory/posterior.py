"""Chance of success of the next try: a Beta posterior over a uniform prior, from a record of tries.

    p | s successes, f failures ~ Beta(s + 1, f + 1)

`SuccessRecord` counts every try alike. Assumes: the tries of one context are alike and independent.

`RecentRecord` is for choices between skills, whose chances may change as parts wear or are repaired. A try
weighs FORGETTING^n, where n is the number of tries of any of the skills to choose from since. So a skill that
was not tried for long is as uncertain as a new one, and is tried again. This is discounted Thompson sampling
(Raj and Kalyani, Taming non-stationary bandits, 2017, arXiv:1707.09727).
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from math import exp, lgamma, log
from random import Random
from typing import Final

MIN_USEFUL_SUCCESS: Final = 0.1
"""A chance of success below which another try is not worth its time."""

HOPELESS_BELOW: Final = 0.05
"""Probability that the success rate is worth a try, below which a skill is called hopeless."""

FORGETTING: Final = 0.875
"""Factor by which one more try lowers the weight of each earlier one: half in about five tries.

Chosen by the sum of successes over 50 sessions of experiment 11 (one skill degrades), of two steady skills
(0.9 and 0.7) and of a skill that is repaired halfway (0.1, then 0.95, beside 0.7); see `docs/memory.md`.
"""

MAX_WEIGHED_TRIES: Final = 200
"""Number of the latest tries that are weighed; an earlier one would weigh less than 1e-9."""


@dataclass(frozen=True, slots=True)
class SuccessRecord:
    """Numbers of successes and failures of a skill.

    Attributes:
        successes: number of runs that succeeded.
        failures: number of runs that failed.
    """

    successes: int
    failures: int

    @property
    def mean(self) -> float:
        """Expected chance of success."""
        return (self.successes + 1) / (self.successes + self.failures + 2)

    @property
    def is_hopeless(self) -> bool:
        """True if P(p > `MIN_USEFUL_SUCCESS`) < `HOPELESS_BELOW`; 28 failures without a success suffice."""
        return self.probability_above(MIN_USEFUL_SUCCESS) < HOPELESS_BELOW

    def probability_above(self, chance: float) -> float:
        """Compute P(p > chance) of the posterior.

        P(Beta(s+1, f+1) > x) = P(Binomial(s+f+1, x) ≤ s), summed in logarithms, since large records would
        underflow.

        Args:
            chance: threshold x, 0 < x < 1.

        Returns:
            A probability in [0, 1].
        """
        tries = self.successes + self.failures + 1
        return min(1.0, sum(_binomial(tries, hits, chance) for hits in range(self.successes + 1)))

    def __str__(self) -> str:
        return f"{self.successes} of {self.successes + self.failures}"


@dataclass(frozen=True, slots=True)
class RecentRecord:
    """Weighted numbers of successes and failures of a skill.

    Attributes:
        successes: sum of the weights of the runs that succeeded.
        failures: sum of the weights of the runs that failed.
    """

    successes: float = 0.0
    failures: float = 0.0

    @property
    def mean(self) -> float:
        """Expected chance of success."""
        return (self.successes + 1) / (self.successes + self.failures + 2)

    def sample(self, random: Random) -> float:
        """Draw a chance of success from the posterior.

        Args:
            random: source of randomness.

        Returns:
            A chance in [0, 1].
        """
        return random.betavariate(self.successes + 1, self.failures + 1)

    def __str__(self) -> str:
        return f"{self.successes:.1f} of {self.successes + self.failures:.1f}"


NO_RESULTS: Final = RecentRecord()
"""Record of a skill that was not tried."""


def weigh_tries(tries: Sequence[tuple[Hashable, bool]]) -> dict[Hashable, RecentRecord]:
    """Weigh tries by their age.

    Args:
        tries: for each try the skill and whether it failed, newest first.

    Returns:
        The record of each skill that was tried.
    """
    sums: dict[Hashable, list[float]] = {}
    weight = 1.0
    for skill, failed in tries:
        sums.setdefault(skill, [0.0, 0.0])[failed] += weight
        weight *= FORGETTING
    return {skill: RecentRecord(*both) for skill, both in sums.items()}


def recent_median(values: Sequence[tuple[int, float]]) -> float:
    """Compute the median of values that are weighed by their age.

    A value of age n weighs FORGETTING^n. Half of the weight of a series is on its latest five or six values.
    So a change is noticed after as many.

    Args:
        values: for each value its age, the number of later tries, and the value; at least one.

    Returns:
        The least value at or below which at least half of the weight is.
    """
    weighed = sorted((value, FORGETTING**age) for age, value in values)
    half = sum(weight for _, weight in weighed) / 2
    below = 0.0
    for value, weight in weighed:
        below += weight
        if below >= half:
            return value
    return weighed[-1][0]  # the sum in another order may be a rounding error less


def _binomial(tries: int, hits: int, chance: float) -> float:
    ways = lgamma(tries + 1) - lgamma(hits + 1) - lgamma(tries - hits + 1)
    return exp(ways + hits * log(chance) + (tries - hits) * log(1 - chance))
