"""Random numbers keyed by (seed, channel, tick), independent of the order in which they are drawn."""

from __future__ import annotations

from zlib import crc32

import numpy as np
from numpy.random import Generator, Philox


class RandomSource:
    """A counter-based random source with one generator per channel and tick.

    The same seed, channel and tick give the same values in every process and after any history.
    """

    def __init__(self, seed: int) -> None:
        self.seed = seed

    def generator(self, channel: str, tick: int = 0) -> Generator:
        """Return the generator of a channel at a tick.

        Args:
            channel: name of what is drawn.
            tick: number of control ticks since the start, 240 a second.

        Returns:
            A new generator (NumPy's Philox, keyed by seed and channel, counter at `tick`).
        """
        # Of a list with a number above 2^63, NumPy makes doubles: seeds below 0 would give the same numbers.
        key = np.array([self.seed % 2**64, crc32(channel.encode())], dtype=np.uint64)
        return Generator(Philox(key=key, counter=[0, 0, 0, tick]))
