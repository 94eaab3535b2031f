"""Intervals and tests, by SciPy.  Sole importer of it."""

from __future__ import annotations

from typing import NamedTuple

from scipy.stats import binomtest, fisher_exact


class Interval(NamedTuple):
    """From low to high."""

    low: float
    high: float


def wilson(hits: int, trials: int) -> Interval:
    """Wilson's 95 % interval of the chance that was met with `hits` times in `trials`."""
    found = binomtest(hits, trials).proportion_ci(0.95, method="wilson")
    return Interval(float(found.low), float(found.high))


def fisher(one: tuple[int, int], other: tuple[int, int], *, one_sided: bool = False) -> float:
    """Fisher's exact test of hits in trials: p where both have one chance.

    one_sided: against that of `one` being higher; else against any other.
    """
    table = [[hits, trials - hits] for hits, trials in (one, other)]
    return float(fisher_exact(table, alternative="greater" if one_sided else "two-sided")[1])


def mcnemar(only_one: int, only_other: int) -> float:
    """McNemar's exact test, two-sided: p of so many pairs in which one of two succeeded alone."""
    pairs = only_one + only_other
    return float(binomtest(only_one, pairs).pvalue) if pairs else 1.0
