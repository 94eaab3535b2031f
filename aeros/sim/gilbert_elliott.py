"""Gilbert-Elliott chains for events that come in bursts (Gilbert, 1960; Elliott, 1963): model and sampler.

The chain has a good and a bad state, takes one step per opportunity, and starts in its stationary
distribution.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Final

from aeros.spec.diagnostics.errors import MisuseError

MAX_MEAN_BURST: Final = 1e9
"""Upper bound on mean burst lengths, in opportunities."""


@dataclass(frozen=True, slots=True)
class GilbertElliottProcess:
    """A Gilbert-Elliott chain as numbers to sample from.

    The chain takes one step per opportunity and starts in its stationary distribution, so from the first
    opportunity on events happen with probability `rate`. Independent draws are a chain that never leaves
    its good state. All attributes are probabilities.

    Attributes:
        bad_state_probability: stationary probability of the bad state.
        good_to_bad: probability that a good state is left.
        bad_to_good: probability that a bad state is left.
        rate_in_bad: probability of an event at an opportunity in the bad state.
        rate_in_good: probability of an event at an opportunity in the good state.
    """

    bad_state_probability: float
    good_to_bad: float
    bad_to_good: float
    rate_in_bad: float
    rate_in_good: float

    @property
    def rate(self) -> float:
        """Long-run share of opportunities at which an event happens."""
        return (
            self.bad_state_probability * self.rate_in_bad
            + (1.0 - self.bad_state_probability) * self.rate_in_good
        )


class GilbertElliottSampler:
    """Sampler of the chain's state at one opportunity after the other.

    Attributes:
        alike: open interval of mean burst lengths, in opportunities, with which the same draws would have
            given the same states so far, at the same rate.
    """

    def __init__(self, process: GilbertElliottProcess) -> None:
        self._process = process
        self._is_bad: bool | None = None
        self.alike = (0.0, MAX_MEAN_BURST)

    def is_bad(self, drawn: float) -> bool:
        """Advance to the next opportunity.

        Args:
            drawn: a uniform random number in [0, 1).

        Returns:
            True if the chain is in its bad state there.
        """
        before, process = self._is_bad, self._process
        if before is None:
            now = drawn < process.bad_state_probability
        else:
            leaves = process.bad_to_good if before else process.good_to_bad
            now = before != (drawn < leaves)
            # The shortest mean burst length with which the state would not have changed.
            stays_from = leaves / process.bad_to_good / drawn if drawn else MAX_MEAN_BURST
            low, high = self.alike
            self.alike = (max(low, stays_from), high) if now is before else (low, min(high, stays_from))
        self._is_bad = now
        return now


@dataclass(frozen=True, slots=True)
class GilbertElliottModel:
    """A Gilbert-Elliott chain in exact fractions, by the numbers it is declared with.

    Attributes:
        rate: long-run probability of an event at an opportunity.
        mean_burst_length: mean length of a stay in the bad state, opportunities.
        rate_in_bad: probability of an event in the bad state.
        rate_in_good: probability of an event in the good state.

    Raises:
        MisuseError: no chain has these numbers: needs 0 ≤ rate_in_good < rate < rate_in_bad ≤ 1 and a
            `mean_burst_length` of at least 1 and at least `min_mean_burst`.
    """

    rate: Fraction
    mean_burst_length: Fraction
    rate_in_bad: Fraction = Fraction(1)
    rate_in_good: Fraction = Fraction(0)

    def __post_init__(self) -> None:
        is_rate = 0 <= self.rate_in_good < self.rate < self.rate_in_bad <= 1
        if not is_rate or not 1 <= self.mean_burst_length >= min_mean_burst(self.bad_state_probability):
            raise MisuseError(f"no Gilbert-Elliott chain has parameters {self}")

    @property
    def bad_state_probability(self) -> Fraction:
        """Stationary probability of the bad state."""
        return (self.rate - self.rate_in_good) / (self.rate_in_bad - self.rate_in_good)

    @property
    def bad_to_good(self) -> Fraction:
        """Probability that a bad state is left."""
        return 1 / self.mean_burst_length

    @property
    def good_to_bad(self) -> Fraction:
        """Probability that a good state is left."""
        return min_mean_burst(self.bad_state_probability) / self.mean_burst_length

    def process(self) -> GilbertElliottProcess:
        """Convert to floating point for sampling.

        Returns:
            The same chain, each probability rounded to the nearest double.
        """
        exact = (
            self.bad_state_probability,
            self.good_to_bad,
            self.bad_to_good,
            self.rate_in_bad,
            self.rate_in_good,
        )
        return GilbertElliottProcess(*map(float, exact))


def min_mean_burst(share_bad: Fraction) -> Fraction:
    """Compute the least mean burst length that is possible with a given share of time in the bad state.

    It is reached where a good state is left at once: good_to_bad = 1.

    Args:
        share_bad: stationary probability of the bad state, in [0, 1).

    Returns:
        share_bad / (1 - share_bad), in opportunities.
    """
    return share_bad / (1 - share_bad)
