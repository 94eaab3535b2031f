"""Whether two times are within a window: exactly, and quick where rounding cannot matter."""

from __future__ import annotations

from fractions import Fraction
from sys import float_info

from aeros.spec.expr.doubles import adjacent_doubles


class TimeWindow:
    """The closed window of `length` seconds.

    A difference of doubles is rounded in order: less than `surely` it is within, more than `maybe` it is not.
    """

    def __init__(self, length: Fraction) -> None:
        self._length = length
        self.surely, above = adjacent_doubles(length)
        self.maybe = min(above, float_info.max)  # what was never is in no window: its time is -inf

    def contains(self, earlier: float, later: float) -> bool:
        """Whether `later` is at most `length` after `earlier`."""
        apart = later - earlier
        return apart < self.surely or (apart <= self.maybe and self.contains_exactly(earlier, later))

    def contains_exactly(self, earlier: float, later: float) -> bool:
        """The same of finite times, whatever was rounded."""
        apart = later - earlier
        if apart == self.surely == self.maybe:
            # Knuth's TwoSum: `apart` and what rounding took off it are the difference, exactly.
            share = apart - later
            return (later - (apart - share)) - (earlier + share) <= 0.0
        return Fraction(later) - Fraction(earlier) <= self._length
