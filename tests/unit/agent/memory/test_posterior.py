from __future__ import annotations

from random import Random
from statistics import fmean

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.agent.memory.posterior import (
    FORGETTING,
    MAX_WEIGHED_TRIES,
    RecentRecord,
    SuccessRecord,
    recent_median,
    weigh_tries,
)

COUNTS = st.integers(0, 60)
RECORDS = st.builds(SuccessRecord, COUNTS, COUNTS)
CHANCES = st.floats(0.01, 0.99)


def test_without_a_record_every_chance_is_as_likely_as_another() -> None:
    nothing = SuccessRecord(0, 0)
    assert nothing.mean == 0.5
    assert nothing.probability_above(0.3) == pytest.approx(0.7)
    assert not nothing.is_hopeless


@given(RECORDS, CHANCES)
def test_the_chance_above_is_the_integral_of_the_density(record: SuccessRecord, chance: float) -> None:
    """Against the midpoint rule over x^s (1 - x)^f."""
    points = [(n + 0.5) / 4000 for n in range(4000)]
    weights = [x**record.successes * (1 - x) ** record.failures for x in points]
    above = sum(weight for x, weight in zip(points, weights, strict=True) if x > chance)
    assert record.probability_above(chance) == pytest.approx(above / sum(weights), abs=2e-2)


@given(RECORDS, CHANCES)
def test_a_success_raises_hope_and_a_failure_lowers_it(record: SuccessRecord, chance: float) -> None:
    better = SuccessRecord(record.successes + 1, record.failures)
    worse = SuccessRecord(record.successes, record.failures + 1)
    assert worse.mean < record.mean < better.mean
    assert worse.probability_above(chance) <= record.probability_above(chance) + 1e-9
    assert record.probability_above(chance) <= better.probability_above(chance) + 1e-9


def test_large_records_do_not_underflow() -> None:
    assert SuccessRecord(100_000, 0).probability_above(0.1) == pytest.approx(1.0)
    assert SuccessRecord(0, 100_000).probability_above(0.1) == 0.0
    assert not SuccessRecord(5_000, 20_000).is_hopeless


def test_hope_ends_after_28_failures_and_a_success_brings_it_back() -> None:
    assert not SuccessRecord(0, 27).is_hopeless
    assert SuccessRecord(0, 28).is_hopeless
    assert not SuccessRecord(1, 28).is_hopeless


def test_draws_are_of_the_posterior() -> None:
    random = Random(0)  # noqa: S311  a test
    draws = [RecentRecord(7.0, 1.0).sample(random) for _ in range(4000)]
    assert fmean(draws) == pytest.approx(RecentRecord(7.0, 1.0).mean, abs=0.01)
    assert fmean(draw > 0.6 for draw in draws) == pytest.approx(
        SuccessRecord(7, 1).probability_above(0.6), abs=0.03
    )


TRIES = st.lists(st.tuples(st.sampled_from("ab"), st.booleans()), max_size=40)


@given(TRIES)
def test_weights_are_sums_of_powers_of_the_factor(tries: list[tuple[str, bool]]) -> None:
    weighed = weigh_tries(tries)
    assert weighed.keys() == {skill for skill, _ in tries}
    for skill, record in weighed.items():
        ages = [age for age, (one, failed) in enumerate(tries) if one == skill and not failed]
        assert record.successes == pytest.approx(sum(FORGETTING**age for age in ages))
    total = sum(one.successes + one.failures for one in weighed.values())
    assert total == pytest.approx((1 - FORGETTING ** len(tries)) / (1 - FORGETTING))


def test_a_long_record_gives_way_to_a_few_new_results() -> None:
    """After 100 successes: the mean falls below a half within ten failures, undiscounted after 100."""
    new_failures = [("a", True)] * 10
    assert weigh_tries(new_failures + [("a", False)] * 100)["a"].mean < 0.4
    assert SuccessRecord(100, 10).mean > 0.9


def test_a_skill_that_was_not_tried_for_long_is_as_uncertain_as_a_new_one() -> None:
    tries = [("b", False)] * 60 + [("a", True)] * 20
    assert weigh_tries(tries)["a"].mean == pytest.approx(0.5, abs=0.01)


def test_no_earlier_try_would_weigh_anything() -> None:
    assert FORGETTING**MAX_WEIGHED_TRIES < 1e-9


@pytest.mark.parametrize(("slower", "expected"), [(0, 10.0), (5, 10.0), (6, 100.0), (30, 100.0)])
def test_a_skill_that_becomes_slow_is_noticed_after_six_tries(slower: int, expected: float) -> None:
    assert recent_median(list(enumerate([100.0] * slower + [10.0] * 50))) == expected


@given(st.lists(st.tuples(st.integers(0, 40), st.floats(0.0, 1e4)), min_size=1, max_size=30))
def test_half_of_the_weight_is_on_either_side_of_a_recent_median(values: list[tuple[int, float]]) -> None:
    found = recent_median(values)
    whole = sum(FORGETTING**age for age, _ in values)
    assert sum(FORGETTING**age for age, value in values if value <= found) >= whole / 2 - 1e-9
    assert sum(FORGETTING**age for age, value in values if value < found) <= whole / 2 + 1e-9
