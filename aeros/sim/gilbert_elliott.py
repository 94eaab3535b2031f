"""What happens in bursts: a chain of two states (Gilbert, 1960; Elliott, 1963), exactly and to draw by.

The chain takes one step an opportunity, and starts as it stays in the long run.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Final

from aeros.spec.diagnostics.errors import MisuseError

LONGEST: Final = 1e9
"""No burst is as long, in opportunities."""


@dataclass(frozen=True, slots=True)
class Process:
    """How often an opportunity is taken: in the long run, and from the first one on, in a share `rate`.

    A chain of two states, one step an opportunity, starts as it stays in the long run.  In the bad
    state, which is left with probability `mends`, an opportunity is taken with probability `within`;
    in the good state, left with probability `worsens`, with probability `between`.
    Independent draws are the chain that never leaves its good state.
    """

    share_bad: float
    worsens: float
    mends: float
    within: float
    between: float

    @property
    def rate(self) -> float:
        """The share of opportunities that are taken."""
        return self.share_bad * self.within + (1.0 - self.share_bad) * self.between


class Chain:
    """The state of a process at one opportunity after the other, by draws from [0, 1).

    alike: mean lengths of stays in the bad state between which all states so far are alike, at the same rate.
    """

    def __init__(self, process: Process) -> None:
        self._process = process
        self._is_bad: bool | None = None
        self.alike = (0.0, LONGEST)

    def is_bad(self, drawn: float) -> bool:
        """The state at the next opportunity."""
        before, process = self._is_bad, self._process
        if before is None:
            now = drawn < process.share_bad
        else:
            leaves = process.mends if before else process.worsens
            now = before != (drawn < leaves)
            # The shortest mean length with which it stays as it was: leaving has that much less of a chance.
            stays_from = leaves / process.mends / drawn if drawn else LONGEST
            low, high = self.alike
            self.alike = (max(low, stays_from), high) if now is before else (low, min(high, stays_from))
        self._is_bad = now
        return now


@dataclass(frozen=True, slots=True)
class Channel:
    """The same chain in fractions, by what it is declared with; raises `MisuseError` where there is none.

    rate: in the long run; mean_length: of a stay in the bad state, opportunities.
    """

    rate: Fraction
    mean_length: Fraction
    within: Fraction = Fraction(1)
    between: Fraction = Fraction(0)

    def __post_init__(self) -> None:
        is_rate = 0 <= self.between < self.rate < self.within <= 1
        if not is_rate or not 1 <= self.mean_length >= shortest(self.share_bad):
            raise MisuseError(f"there is no channel with {self}")

    @property
    def share_bad(self) -> Fraction:
        """How much of its time it is in the bad state."""
        return (self.rate - self.between) / (self.within - self.between)

    @property
    def mends(self) -> Fraction:
        """The probability that a bad state is left."""
        return 1 / self.mean_length

    @property
    def worsens(self) -> Fraction:
        """The probability that a good state is left."""
        return shortest(self.share_bad) / self.mean_length

    def process(self) -> Process:
        """To draw by."""
        exact = (self.share_bad, self.worsens, self.mends, self.within, self.between)
        return Process(*map(float, exact))


def shortest(share_bad: Fraction) -> Fraction:
    """The least mean length of a stay in the bad state that is met where so much time is spent in it."""
    return share_bad / (1 - share_bad)
