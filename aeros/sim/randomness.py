"""Random values keyed by (seed, channel, tick), whatever the order they are drawn in."""

from __future__ import annotations

from zlib import crc32

from numpy.random import Generator, Philox


class RandomSource:
    """A counter-based source of randomness: one generator per channel and tick.

    The same seed, channel and tick give the same values in every process and after any history.
    """

    def __init__(self, seed: int) -> None:
        self.seed = seed

    def generator(self, channel: str, tick: int = 0) -> Generator:
        """The generator of `channel` at `tick` (a count, 240 a second)."""
        return Generator(Philox(key=[self.seed % 2**64, crc32(channel.encode())], counter=[0, 0, 0, tick]))
