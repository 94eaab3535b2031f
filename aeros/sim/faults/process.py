"""Which opportunities a fault takes: one stream of randomness for each fault, keyed by its name.

What is drawn depends on the seed, the fault's name, its process and the opportunity's number alone: not on
other faults, on their order, or on what happens meanwhile.
"""

from __future__ import annotations

from math import inf
from typing import Final

from numpy.random import Generator

from aeros.sim.faults.model import Fault
from aeros.sim.randomness import Chance

_LONGEST: Final = 1e9
"""No burst is as long, in opportunities."""


class Draws:
    """The opportunities of one fault, one after the other."""

    def __init__(self, fault: Fault, chance: Chance) -> None:
        self._channel = f"fault/{fault.name}"
        self._process = fault.process
        self._left = inf if fault.at_most is None else fault.at_most
        self._chance = chance
        self._is_bad = False
        self.count = 0
        self._highest_taken, self._lowest_left = 0.0, 1.0
        self._longest_turned, self._shortest_kept = 0.0, _LONGEST

    @property
    def alike(self) -> tuple[float, float]:
        """Between which numbers draws without `at_most` would all have come out as they have.

        Rates where they are independent; in bursts mean lengths of these, at the same rate.
        """
        if self._process.share_bad:
            return self._longest_turned, self._shortest_kept
        return self._highest_taken, self._lowest_left

    def next(self) -> Generator | None:
        """None where the next opportunity is not taken, else what the fault itself may draw from."""
        source = self._chance.on(self._channel, self.count)
        state, event = (float(part) for part in source.uniform(size=2))
        before = self._is_bad if self.count else None
        self._is_bad = self._process.is_bad(before, state)
        if before is not None:
            self._turned(self._process.turns_at(before, state), is_other=self._is_bad is not before)
        self.count += 1
        rate = self._process.within if self._is_bad else self._process.between
        if event >= rate or self._left <= 0:
            self._lowest_left = min(self._lowest_left, event)
            return None
        self._highest_taken = max(self._highest_taken, event)
        self._left -= 1
        return source

    def _turned(self, length: float, *, is_other: bool) -> None:
        """Bursts shorter than `length` turn the state here; whether ours did."""
        if is_other:
            self._shortest_kept = min(self._shortest_kept, length)
        else:
            self._longest_turned = max(self._longest_turned, length)
