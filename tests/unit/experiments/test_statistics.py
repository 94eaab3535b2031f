"""Intervals and tests, by values of textbooks and of the paper."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from aeros.experiments.statistics import (
    detectable_difference,
    difference_interval,
    fisher_exact_test,
    holm,
    mcnemar,
    median_interval,
    wilson,
)


@pytest.mark.parametrize(
    ("hits", "interval"),
    [(57, (0.472, 0.663)), (95, (0.888, 0.978)), (100, (0.963, 1.0)), (0, (0.0, 0.037))],
)
def test_wilsons_interval_is_the_papers(hits: int, interval: tuple[float, float]) -> None:
    assert wilson(hits, 100) == pytest.approx(interval, abs=6e-4)


@pytest.mark.parametrize(("hits", "p"), [(95, 0.030), (93, 0.007)])
def test_the_papers_p_is_of_fishers_test_with_one_side(hits: int, p: float) -> None:
    assert fisher_exact_test((100, 100), (hits, 100), one_sided=True) == pytest.approx(p, abs=5e-4)
    assert fisher_exact_test((100, 100), (hits, 100)) == pytest.approx(2 * p, abs=1e-3)


def test_fishers_test_of_the_same_is_1() -> None:
    assert fisher_exact_test((50, 100), (50, 100)) == pytest.approx(1.0)


def test_mcnemars_test_counts_pairs_that_differ() -> None:
    assert mcnemar(5, 0) == pytest.approx(2 * 0.5**5)
    assert mcnemar(0, 0) == 1.0
    assert mcnemar(3, 3) == 1.0


@pytest.mark.parametrize(
    ("count", "places"),
    # ranks as tables of distribution-free intervals have them, counted from 1
    [(6, (1, 6)), (10, (2, 9)), (20, (6, 15)), (100, (40, 61))],
)
def test_the_interval_of_a_median_is_between_ranks(count: int, places: tuple[int, int]) -> None:
    values = [float(value) for value in range(count, 0, -1)]
    assert median_interval(values) == places


def test_few_values_have_no_interval_of_their_median() -> None:
    assert median_interval([1.0, 2.0, 3.0, 4.0, 5.0]) is None


@pytest.mark.parametrize(
    ("one", "other", "interval"),
    # Newcombe 1998, table II, method 10: contrasts (a), (c) and (h)
    [
        ((56, 70), (48, 80), (0.0524, 0.3339)),
        ((9, 10), (3, 10), (0.1705, 0.8090)),
        ((10, 10), (0, 10), (0.6075, 1.0)),
    ],
)
def test_the_interval_of_a_difference_is_newcombes(
    one: tuple[int, int], other: tuple[int, int], interval: tuple[float, float]
) -> None:
    assert difference_interval(one, other) == pytest.approx(interval, abs=6e-5)
    low, high = difference_interval(other, one)
    assert (-high, -low) == pytest.approx(interval, abs=6e-5)


def test_holm_multiplies_by_the_tests_that_are_left_and_keeps_the_order() -> None:
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([0.9, 0.8]) == [1.0, 1.0]
    assert holm([]) == []


@pytest.mark.parametrize("hits", [100, 96, 60])
def test_a_difference_that_is_detectable_is_found_in_four_of_five_cases(hits: int) -> None:
    rng = np.random.default_rng(0)
    known = hits / 100
    pairs = zip(
        rng.binomial(100, known, 2000).tolist(),
        rng.binomial(100, known - detectable_difference(hits, 100), 2000).tolist(),
        strict=True,
    )
    found = Counter(pairs)
    seen = sum(
        number for (one, other), number in found.items() if fisher_exact_test((one, 100), (other, 100)) < 0.05
    )
    assert seen / 2000 == pytest.approx(0.8, abs=0.03)


def test_the_largest_difference_is_the_whole_probability() -> None:
    assert detectable_difference(1, 100) == pytest.approx(0.01, abs=1e-5)
    # Fisher's test of 100 and 94 of 100 has p = 0.029, of 100 and 95 it has 0.059
    assert detectable_difference(100, 100) == pytest.approx(0.0777, abs=5e-4)
