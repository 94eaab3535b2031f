"""Confidence intervals and tests, by SciPy.  Sole importer of it.

The functions import it themselves: it takes 0.9 s, which a process that computes no results need not pay.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple


class ConfidenceInterval(NamedTuple):
    """A closed confidence interval.

    Attributes:
        low: lower end, in the unit of the estimated value.
        high: upper end, in the same unit.
    """

    low: float
    high: float


def wilson(hits: int, trials: int) -> ConfidenceInterval:
    """Compute Wilson's 95 % interval of a probability.

    Args:
        hits: number of successes.
        trials: number of trials, at least 1.

    Returns:
        The interval, within [0, 1].
    """
    from scipy.stats import binomtest

    found = binomtest(hits, trials).proportion_ci(0.95, method="wilson")
    return ConfidenceInterval(float(found.low), float(found.high))


def median_interval(values: Sequence[float]) -> ConfidenceInterval | None:
    """Compute a 95 % interval of the median, whatever the distribution is.

    It lies between the k-th smallest and the k-th largest value, where fewer than k of n fair coins fall on
    one side with a probability of at most 2.5 %.

    Args:
        values: measured values, in any order.

    Returns:
        The interval in the unit of the values; None for fewer than six values.
    """
    from scipy.stats import binom

    k = int(binom.ppf(0.025, len(values), 0.5))
    if k < 1:
        return None
    ordered = sorted(values)
    return ConfidenceInterval(ordered[k - 1], ordered[-k])


def fisher_exact_test(one: tuple[int, int], other: tuple[int, int], *, one_sided: bool = False) -> float:
    """Test by Fisher's exact test whether two sets of trials have the same probability of success.

    Args:
        one: hits and trials of the first.
        other: hits and trials of the second.
        one_sided: test against a higher probability of `one`; else against any difference.

    Returns:
        The p-value.
    """
    from scipy.stats import fisher_exact

    table = [[hits, trials - hits] for hits, trials in (one, other)]
    return float(fisher_exact(table, alternative="greater" if one_sided else "two-sided")[1])


def mcnemar(only_one: int, only_other: int) -> float:
    """Test by McNemar's exact test, two-sided, whether paired trials succeed equally often.

    Args:
        only_one: number of pairs in which only the first succeeded.
        only_other: number of pairs in which only the second succeeded.

    Returns:
        The p-value; 1 where there is no such pair.
    """
    from scipy.stats import binomtest

    pairs = only_one + only_other
    return float(binomtest(only_one, pairs).pvalue) if pairs else 1.0
