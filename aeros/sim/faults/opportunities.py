"""Sample the opportunities at which a fault happens, with one random stream per fault, keyed by its name.

The draws depend only on the seed, the fault's name, its process and the number of the opportunity: not on
other faults, their order, or other events of the run.
"""

from __future__ import annotations

from math import inf

from numpy.random import Generator

from aeros.sim.faults.model import Fault
from aeros.sim.gilbert_elliott import GilbertElliottSampler
from aeros.sim.randomness import RandomSource


class OpportunitySampler:
    """Sampler of the opportunities of one fault, one after the other.

    Args:
        fault: the fault.
        chance: random source of the run.

    Attributes:
        count: number of opportunities so far.
    """

    def __init__(self, fault: Fault, chance: RandomSource) -> None:
        self._channel = f"fault/{fault.name}"
        self._process = fault.process
        self._remaining = inf if fault.max_count is None else fault.max_count
        self._chance = chance
        self._chain = GilbertElliottSampler(fault.process)
        self.count = 0
        self._highest_hit, self._lowest_miss = 0.0, 1.0

    @property
    def equivalent_rates(self) -> tuple[float, float]:
        """Open interval of rates with which the draws so far, without `max_count`, come out the same.

        For faults in bursts: of mean burst lengths in opportunities, at the same rate.
        """
        if self._process.bad_state_probability:
            return self._chain.alike
        return self._highest_hit, self._lowest_miss

    def next(self) -> Generator | None:
        """Draw if the fault happens at its next opportunity.

        Returns:
            None if it does not happen; else the generator that the fault's effect may draw from.
        """
        rng = self._chance.generator(self._channel, self.count)
        state, event = (float(part) for part in rng.uniform(size=2))
        self.count += 1
        rate = self._process.rate_in_bad if self._chain.is_bad(state) else self._process.rate_in_good
        if event >= rate or self._remaining <= 0:
            self._lowest_miss = min(self._lowest_miss, event)
            return None
        self._highest_hit = max(self._highest_hit, event)
        self._remaining -= 1
        return rng
