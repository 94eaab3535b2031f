"""Chance of success of the next try: a Beta posterior over a uniform prior, from a record of tries.

    p | s successes, f failures ~ Beta(s + 1, f + 1)

Assumes: the tries of one context are alike and independent of each other.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, lgamma, log
from random import Random
from typing import Final

MIN_USEFUL_SUCCESS: Final = 0.1
"""A chance of success below which another try is not worth its time."""

HOPELESS_BELOW: Final = 0.05
"""Probability that the success rate is worth a try, below which a skill is called hopeless."""


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

    def sample(self, random: Random) -> float:
        """Draw a chance of success from the posterior.

        Args:
            random: source of randomness.

        Returns:
            A chance in [0, 1].
        """
        return random.betavariate(self.successes + 1, self.failures + 1)

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


def _binomial(tries: int, hits: int, chance: float) -> float:
    ways = lgamma(tries + 1) - lgamma(hits + 1) - lgamma(tries - hits + 1)
    return exp(ways + hits * log(chance) + (tries - hits) * log(1 - chance))
