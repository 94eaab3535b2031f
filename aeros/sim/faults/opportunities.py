"""Which opportunities a fault takes: one stream of randomness for each fault, keyed by its name.

What is drawn depends on the seed, the fault's name, its process and the opportunity's number alone: not on
other faults, on their order, or on what happens meanwhile.
"""

from __future__ import annotations

from math import inf

from numpy.random import Generator

from aeros.sim.faults.model import Fault
from aeros.sim.gilbert_elliott import GilbertElliottSampler
from aeros.sim.randomness import RandomSource


class OpportunitySampler:
    """The opportunities of one fault, one after the other."""

    def __init__(self, fault: Fault, chance: RandomSource) -> None:
        self._channel = f"fault/{fault.name}"
        self._process = fault.process
        self._left = inf if fault.max_count is None else fault.max_count
        self._chance = chance
        self._chain = GilbertElliottSampler(fault.process)
        self.count = 0
        self._highest_taken, self._lowest_left = 0.0, 1.0

    @property
    def equivalent_rates(self) -> tuple[float, float]:
        """Between which numbers draws without `max_count` would all have come out as they have.

        Rates where they are independent; in bursts mean lengths of these, at the same rate.
        """
        if self._process.bad_state_probability:
            return self._chain.alike
        return self._highest_taken, self._lowest_left

    def next(self) -> Generator | None:
        """None where the next opportunity is not taken, else what the fault itself may draw from."""
        source = self._chance.generator(self._channel, self.count)
        state, event = (float(part) for part in source.uniform(size=2))
        self.count += 1
        rate = self._process.rate_in_bad if self._chain.is_bad(state) else self._process.rate_in_good
        if event >= rate or self._left <= 0:
            self._lowest_left = min(self._lowest_left, event)
            return None
        self._highest_taken = max(self._highest_taken, event)
        self._left -= 1
        return source
