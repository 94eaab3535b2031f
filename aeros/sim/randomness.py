"""Random numbers keyed by (seed, channel, tick), independent of the order in which they are drawn."""

from __future__ import annotations

from zlib import crc32

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
        return Generator(Philox(key=[self.seed % 2**64, crc32(channel.encode())], counter=[0, 0, 0, tick]))
