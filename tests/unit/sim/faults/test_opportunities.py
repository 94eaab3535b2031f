"""Opportunities are taken as often as declared, independent of other declarations."""

from __future__ import annotations

from itertools import pairwise
from math import sqrt

import pytest

from aeros.sim.faults.model import CameraOpportunity, Fault
from aeros.sim.faults.opportunities import OpportunitySampler
from aeros.sim.gilbert_elliott import GilbertElliottProcess
from aeros.sim.randomness import RandomSource
from aeros.spec.declared.faults import MissedPictureFault

DRAWS = 20_000


def taken(process: GilbertElliottProcess, name: str = "one", seed: int = 0, count: int = DRAWS) -> list[bool]:
    draws = OpportunitySampler(
        Fault(name, CameraOpportunity("mast"), process, MissedPictureFault()), RandomSource(seed)
    )
    return [draws.next() is not None for _ in range(count)]


def independent(rate: float) -> GilbertElliottProcess:
    return GilbertElliottProcess(0.0, 0.0, 1.0, 1.0, rate)


def bursts(rate: float, length: float, within: float = 1.0, between: float = 0.0) -> GilbertElliottProcess:
    share = (rate - between) / (within - between)
    return GilbertElliottProcess(share, share / (1.0 - share) / length, 1.0 / length, within, between)


@pytest.mark.parametrize("rate", [0.3, *(pytest.param(one, marks=pytest.mark.deep) for one in (0.05, 0.9))])
def test_the_measured_rate_lies_in_its_95_percent_interval_95_times_of_a_hundred(rate: float) -> None:
    half = 1.96 * sqrt(rate * (1.0 - rate) / 1000)
    inside = sum(
        abs(sum(taken(independent(rate), name=f"fault{number}", count=1000)) / 1000 - rate) < half
        for number in range(100)
    )
    # Fewer than 88 of 100 has a chance of 0.1 %.
    assert inside >= 88


@pytest.mark.parametrize("rate", [0.0, 1.0])
def test_rates_0_and_1_mean_never_and_always(rate: float) -> None:
    assert set(taken(independent(rate), count=1000)) == {rate == 1.0}


@pytest.mark.parametrize(("rate", "length"), [(0.1, 5.0), (0.3, 10.0)])
def test_bursts_keep_the_rate_and_last_as_long_as_declared(rate: float, length: float) -> None:
    process = bursts(rate, length)
    assert process.rate == pytest.approx(rate)
    drawn = taken(process)
    # Of a chain with these transitions the variance of the mean is larger by (1 + r) / (1 − r).
    kept = 1.0 - process.good_to_bad - process.bad_to_good
    spread = sqrt(rate * (1.0 - rate) / DRAWS * (1.0 + kept) / (1.0 - kept))
    assert abs(sum(drawn) / DRAWS - rate) < 1.96 * spread
    started = sum(now and not before for before, now in pairwise([False, *drawn]))
    assert sum(drawn) / started == pytest.approx(length, rel=0.1)


def test_the_first_opportunity_is_taken_as_often_as_any_other() -> None:
    process, runs = bursts(0.3, 4.0, within=0.8, between=0.05), 4000
    for nth in range(3):
        measured = sum(taken(process, seed=seed, count=3)[nth] for seed in range(runs)) / runs
        assert abs(measured - 0.3) < 1.96 * sqrt(0.3 * 0.7 / runs)


def test_bursts_of_another_length_that_it_says_are_alike_are_and_none_beyond() -> None:
    def drawn(length: float, seed: int) -> tuple[list[bool], tuple[float, float]]:
        draws = OpportunitySampler(
            Fault("one", CameraOpportunity("mast"), bursts(0.3, length), MissedPictureFault()),
            RandomSource(seed),
        )
        return [draws.next() is not None for _ in range(6)], draws.equivalent_rates

    for seed in range(200):
        ours, (low, high) = drawn(8.0, seed)
        assert low < 8.0 < high
        assert drawn(low * 1.001, seed)[0] == drawn(min(high * 0.999, 1e6), seed)[0] == ours
        for beyond in ([low * 0.999] if low > 1.0 else []) + ([high * 1.001] if high < 1e9 else []):
            assert drawn(beyond, seed)[0] != ours


def test_bursts_come_together_and_independent_faults_do_not() -> None:
    def after_one(drawn: list[bool]) -> float:
        followers = [now for before, now in pairwise(drawn) if before]
        return sum(followers) / len(followers)

    assert after_one(taken(bursts(0.3, 10.0))) == pytest.approx(0.9, abs=0.02)
    assert after_one(taken(independent(0.3))) == pytest.approx(0.3, abs=0.02)


def test_faults_of_other_names_and_seeds_are_drawn_by_themselves() -> None:
    process = independent(0.5)
    one = taken(process, "one", 0, 2000)
    assert one == taken(process, "one", 0, 2000)
    for other in (taken(process, "other", 0, 2000), taken(process, "one", 1, 2000)):
        alike = sum(a == b for a, b in zip(one, other, strict=True)) / 2000
        assert abs(alike - 0.5) < 4.0 * sqrt(0.25 / 2000)


def test_a_fault_that_has_happened_as_often_as_it_may_does_not_happen_again() -> None:
    fault = Fault("one", CameraOpportunity("mast"), independent(0.5), MissedPictureFault(), max_count=2)
    draws = OpportunitySampler(fault, RandomSource(0))
    assert sum(draws.next() is not None for _ in range(100)) == 2
