"""Random numbers depend on seed, channel and tick, and on nothing else."""

from __future__ import annotations

import pytest

from aeros.sim.randomness import RandomSource

NUMBERS = (0.4079636871955098, 0.6977003375894233, 0.553913440976851, 0.9787110405669008)


def drawn(seed: int, channel: str = "noise", tick: int = 0) -> list[float]:
    values: list[float] = RandomSource(seed).generator(channel, tick).uniform(size=4).tolist()
    return values


def test_the_same_key_gives_the_same_numbers_after_any_history() -> None:
    source = RandomSource(7)
    source.generator("other", 3).uniform(size=100)
    assert source.generator("noise", 5).uniform(size=4).tolist() == drawn(7, "noise", 5)
    assert source.seed == 7


@pytest.mark.parametrize("other", [(8, "noise", 5), (7, "Noise", 5), (7, "noise", 6), (-7, "noise", 5)])
def test_another_seed_channel_or_tick_gives_others(other: tuple[int, str, int]) -> None:
    assert set(drawn(*other)).isdisjoint(drawn(7, "noise", 5))


def test_consecutive_ticks_do_not_overlap() -> None:
    long = RandomSource(1).generator("noise", 0).uniform(size=5000).tolist()
    assert set(long).isdisjoint(drawn(1, "noise", 1))


def test_the_numbers_are_those_of_recorded_runs() -> None:
    # What another value here would change: every recorded run with noise. NumPy's Philox, key (7, CRC-32 of
    # "noise"), counter (0, 0, 0, 5).
    assert drawn(7, "noise", 5) == pytest.approx(NUMBERS, abs=1e-15)


def test_without_a_tick_it_is_the_start() -> None:
    assert RandomSource(3).generator("a").uniform() == RandomSource(3).generator("a", 0).uniform()


def test_large_and_negative_seeds_are_taken_by_64_bits() -> None:
    assert drawn(2**64 + 7) == drawn(7)
    assert drawn(-1) == drawn(2**64 - 1)
    # As doubles, all of these would be the same number.
    assert len({tuple(drawn(seed)) for seed in (0, -1, -2, 2**63, 2**63 + 1)}) == 5
