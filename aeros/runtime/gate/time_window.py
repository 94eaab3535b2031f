"""Exact test of whether two times lie within a window, fast where rounding cannot matter."""

from __future__ import annotations

from fractions import Fraction
from sys import float_info

from aeros.spec.expr.doubles import adjacent_doubles


class TimeWindow:
    """The closed time window of `length` seconds.

    surely: a rounded difference below this double is within the window.
    maybe: a rounded difference above this double is outside; in between, `contains_exactly` decides. Rounding
        keeps order, so both comparisons are exact.
    """

    def __init__(self, length: Fraction) -> None:
        self._length = length
        self.surely, above = adjacent_doubles(length)
        self.maybe = min(above, float_info.max)  # -inf, the time of what never happened, is in no window

    def contains(self, earlier: float, later: float) -> bool:
        """Return True if `later` is at most `length` after `earlier`.

        Args:
            earlier: a time, s; `-inf` is in no window.
            later: a time, s, not before `earlier`.
        """
        apart = later - earlier
        return apart < self.surely or (apart <= self.maybe and self.contains_exactly(earlier, later))

    def contains_exactly(self, earlier: float, later: float) -> bool:
        """Return what `contains` returns, computed without rounding.

        Args:
            earlier: a finite time, s.
            later: a finite time, s, not before `earlier`.
        """
        apart = later - earlier
        if apart == self.surely == self.maybe:
            # Knuth's TwoSum: `apart` and its rounding error add up to the exact difference.
            share = apart - later
            return (later - (apart - share)) - (earlier + share) <= 0.0
        return Fraction(later) - Fraction(earlier) <= self._length
