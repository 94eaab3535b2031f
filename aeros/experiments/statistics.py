"""Confidence intervals and tests, by SciPy.  Sole importer of it.

The functions import it themselves: it takes 0.9 s, which a process that computes no results need not pay.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from functools import cache
from itertools import accumulate
from math import hypot
from operator import mul
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


def difference_interval(one: tuple[int, int], other: tuple[int, int]) -> ConfidenceInterval:
    """Compute a 95 % interval of the difference of two probabilities of success.

    Newcombe's hybrid of Wilson's intervals: Statistics in Medicine 17, 1998, pages 873 to 890, method 10. It
    takes the trials as independent, so it is wider than needed where both ran the same seeds.

    Args:
        one: hits and trials of the first.
        other: hits and trials of the second.

    Returns:
        The interval of the first less the second, within [-1, 1].
    """
    (first, second), (low, high) = (
        (hits / trials for hits, trials in (one, other)),
        zip(wilson(*one), wilson(*other), strict=True),
    )
    difference = first - second
    return ConfidenceInterval(
        difference - hypot(first - low[0], high[1] - second),
        difference + hypot(high[0] - first, second - low[1]),
    )


def detectable_difference(hits: int, trials: int) -> float:
    """Compute how much less likely another must succeed to be told apart in four of five cases.

    By Fisher's exact test with two sides at 5 %, without correction, and as many trials of each. The power is
    summed over all results of both, so it also holds where nearly all trials succeed.

    Args:
        hits: number of successes of the likelier one, whose share is taken as its probability.
        trials: number of trials of each, at least 1.

    Returns:
        The difference of the probabilities, within [0, 1]; the whole probability if it would have to be more.
    """
    from scipy.stats import binom

    known, counts = hits / trials, range(trials + 1)
    chances = binom.pmf(counts, trials, known).tolist()
    rejected = _fisher_rejections(trials)
    seen = [sum(chances[one] for one in rejected[other]) for other in counts]
    low, high = 0.0, known
    while high - low > 1e-6:
        middle = (low + high) / 2
        if sum(map(mul, binom.pmf(counts, trials, known - middle).tolist(), seen)) >= 0.8:
            high = middle
        else:
            low = middle
    return high


@cache
def _fisher_rejections(trials: int) -> list[list[int]]:
    """List, for each number of successes of one, those of another that Fisher's test tells apart from it.

    With two sides at 5 %, and as many trials of each: a table counts with all that are no likelier.
    """
    from scipy.stats import hypergeom

    apart: list[list[int]] = [[] for _ in range(trials + 1)]
    for both in range(2 * trials + 1):
        first = range(max(0, both - trials), min(both, trials) + 1)
        chances = hypergeom.pmf(first, 2 * trials, both, trials).tolist()
        order = sorted(chances)
        below = [0.0, *accumulate(order)]
        for one, chance in zip(first, chances, strict=True):
            if below[bisect_right(order, chance * (1 + 1e-7))] < 0.05:
                apart[both - one].append(one)
    return apart


def holm(p_values: Sequence[float]) -> list[float]:
    """Correct p-values for the number of tests, by Holm's method: Scandinavian Journal of Statistics 6, 1979.

    Args:
        p_values: of all tests of one family.

    Returns:
        The corrected values, in the same order; one below 5 % is wrong in at most 5 % of all families.
    """
    corrected, highest = [0.0] * len(p_values), 0.0
    for rank, place in enumerate(sorted(range(len(p_values)), key=lambda at: p_values[at])):
        highest = max(highest, min(1.0, (len(p_values) - rank) * p_values[place]))
        corrected[place] = highest
    return corrected
