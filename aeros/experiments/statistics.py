"""Intervals and tests, by SciPy.  Sole importer of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from scipy.stats import binom, binomtest, fisher_exact


class ConfidenceInterval(NamedTuple):
    """From low to high."""

    low: float
    high: float


def wilson(hits: int, trials: int) -> ConfidenceInterval:
    """Wilson's 95 % interval of the chance that was met with `hits` times in `trials`."""
    found = binomtest(hits, trials).proportion_ci(0.95, method="wilson")
    return ConfidenceInterval(float(found.low), float(found.high))


def median_interval(values: Sequence[float]) -> ConfidenceInterval | None:
    """A 95 % interval of the median, whatever the distribution is; fewer than six values have none.

    Between the k-th smallest and the k-th largest, where fewer than k of n fair coins fall on one side with a
    chance of at most 2.5 %.
    """
    k = int(binom.ppf(0.025, len(values), 0.5))
    if k < 1:
        return None
    ordered = sorted(values)
    return ConfidenceInterval(ordered[k - 1], ordered[-k])


def fisher_exact_test(one: tuple[int, int], other: tuple[int, int], *, one_sided: bool = False) -> float:
    """Fisher's exact test of hits in trials: p where both have one chance.

    one_sided: against that of `one` being higher; else against any other.
    """
    table = [[hits, trials - hits] for hits, trials in (one, other)]
    return float(fisher_exact(table, alternative="greater" if one_sided else "two-sided")[1])


def mcnemar(only_one: int, only_other: int) -> float:
    """McNemar's exact test, two-sided: p of so many pairs in which one of two succeeded alone."""
    pairs = only_one + only_other
    return float(binomtest(only_one, pairs).pvalue) if pairs else 1.0
