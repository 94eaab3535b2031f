"""What happens in bursts: a chain of two states (Gilbert, 1960; Elliott, 1963), exactly and to draw by.

The chain takes one step an opportunity, and starts as it stays in the long run.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Final

from aeros.spec.diagnostics.errors import MisuseError

MAX_MEAN_BURST: Final = 1e9
"""No burst is as long, in opportunities."""


@dataclass(frozen=True, slots=True)
class GilbertElliottProcess:
    """How often an opportunity is taken: in the long run, and from the first one on, in a share `rate`.

    A chain of two states, one step an opportunity, starts as it stays in the long run.  In the bad
    state, which is left with probability `bad_to_good`, an opportunity is taken with probability
    `rate_in_bad`; in the good state, left with probability `good_to_bad`, with probability `rate_in_good`.
    Independent draws are the chain that never leaves its good state.
    """

    bad_state_probability: float
    good_to_bad: float
    bad_to_good: float
    rate_in_bad: float
    rate_in_good: float

    @property
    def rate(self) -> float:
        """The share of opportunities that are taken."""
        return (
            self.bad_state_probability * self.rate_in_bad
            + (1.0 - self.bad_state_probability) * self.rate_in_good
        )


class GilbertElliottSampler:
    """The state of a process at one opportunity after the other, by draws from [0, 1).

    alike: mean lengths of stays in the bad state between which all states so far are alike, at the same rate.
    """

    def __init__(self, process: GilbertElliottProcess) -> None:
        self._process = process
        self._is_bad: bool | None = None
        self.alike = (0.0, MAX_MEAN_BURST)

    def is_bad(self, drawn: float) -> bool:
        """The state at the next opportunity."""
        before, process = self._is_bad, self._process
        if before is None:
            now = drawn < process.bad_state_probability
        else:
            leaves = process.bad_to_good if before else process.good_to_bad
            now = before != (drawn < leaves)
            # The shortest mean length with which it stays as it was: leaving has that much less of a chance.
            stays_from = leaves / process.bad_to_good / drawn if drawn else MAX_MEAN_BURST
            low, high = self.alike
            self.alike = (max(low, stays_from), high) if now is before else (low, min(high, stays_from))
        self._is_bad = now
        return now


@dataclass(frozen=True, slots=True)
class GilbertElliottModel:
    """The same chain in fractions, by what it is declared with; raises `MisuseError` where there is none.

    rate: in the long run; mean_length: of a stay in the bad state, opportunities.
    """

    rate: Fraction
    mean_burst_length: Fraction
    rate_in_bad: Fraction = Fraction(1)
    rate_in_good: Fraction = Fraction(0)

    def __post_init__(self) -> None:
        is_rate = 0 <= self.rate_in_good < self.rate < self.rate_in_bad <= 1
        if not is_rate or not 1 <= self.mean_burst_length >= min_mean_burst(self.bad_state_probability):
            raise MisuseError(f"there is no channel with {self}")

    @property
    def bad_state_probability(self) -> Fraction:
        """How much of its time it is in the bad state."""
        return (self.rate - self.rate_in_good) / (self.rate_in_bad - self.rate_in_good)

    @property
    def bad_to_good(self) -> Fraction:
        """The probability that a bad state is left."""
        return 1 / self.mean_burst_length

    @property
    def good_to_bad(self) -> Fraction:
        """The probability that a good state is left."""
        return min_mean_burst(self.bad_state_probability) / self.mean_burst_length

    def process(self) -> GilbertElliottProcess:
        """To draw by."""
        exact = (
            self.bad_state_probability,
            self.good_to_bad,
            self.bad_to_good,
            self.rate_in_bad,
            self.rate_in_good,
        )
        return GilbertElliottProcess(*map(float, exact))


def min_mean_burst(share_bad: Fraction) -> Fraction:
    """The least mean length of a stay in the bad state that is met where so much time is spent in it."""
    return share_bad / (1 - share_bad)
