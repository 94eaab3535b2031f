"""Intervals and tests, by values of textbooks and of the paper."""

from __future__ import annotations

import pytest

from aeros.experiments.statistics import fisher_exact_test, mcnemar, median_interval, wilson


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
