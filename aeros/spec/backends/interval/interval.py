"""Exact intervals of reals, with open, closed or no ends."""

from __future__ import annotations

from fractions import Fraction
from math import ceil, floor
from typing import Literal, NamedTuple, TypeAlias

End: TypeAlias = Literal["low", "high"] | None
"""End of an interval near which a number is picked; None for its middle."""


class Interval(NamedTuple):
    """Interval of reals.

    Attributes:
        low: lower end; None if it is unbounded below.
        high: upper end; None if it is unbounded above.
        low_open: True if `low` is not in it.
        high_open: True if `high` is not in it.
    """

    low: Fraction | None = None
    high: Fraction | None = None
    low_open: bool = False
    high_open: bool = False

    @property
    def is_empty(self) -> bool:
        """True if the interval has no real."""
        if self.low is None or self.high is None:
            return False
        order = _order(self.low, self.high)
        return order > 0 or (order == 0 and (self.low_open or self.high_open))

    def intersect(self, other: Interval) -> Interval:
        """Intersect with another interval.

        Args:
            other: another interval.

        Returns:
            The reals in both.
        """
        low, low_open = self.low, self.low_open
        if other.low is not None:
            order = 1 if low is None else _order(other.low, low)
            if order >= 0:
                low, low_open = other.low, other.low_open or (order == 0 and low_open)
        high, high_open = self.high, self.high_open
        if other.high is not None:
            order = -1 if high is None else _order(other.high, high)
            if order <= 0:
                high, high_open = other.high, other.high_open or (order == 0 and high_open)
        return Interval(low, high, low_open, high_open)

    def midpoint(self) -> Fraction:
        """Return a real of the interval.

        Returns:
            Its midpoint; 1 inside the only end; 0 if it has no ends.
        """
        if self.low is None:
            return Fraction(0) if self.high is None else self.high - 1
        return self.low + 1 if self.high is None else (self.low + self.high) / 2

    def pick_near(self, end: End) -> Fraction:
        """Return a real of the interval near one end.

        Args:
            end: the end; None for the midpoint.

        Returns:
            That end if it belongs to the interval, else the point an eighth of the width inside it. The
            midpoint, if the interval is unbounded.
        """
        if self.low is None or self.high is None or end is None:
            return self.midpoint()
        if end == "low":
            return self.low + (self.high - self.low) / 8 if self.low_open else self.low
        return self.high - (self.high - self.low) / 8 if self.high_open else self.high

    def pick_integer(self, end: End = None) -> Fraction:
        """Return a whole number of the interval near one end.

        Args:
            end: the end; None for the midpoint.

        Returns:
            One of the two whole numbers around `pick_near(end)` if it belongs to the interval; else that
            real.
        """
        middle = self.pick_near(end)
        near = (Fraction(floor(middle)), Fraction(ceil(middle)))
        return next(
            (number for number in near if not self.intersect(Interval(number, number)).is_empty), middle
        )

    def add(self, other: Interval) -> Interval:
        """Add intervals.

        Args:
            other: another interval.

        Returns:
            The sums of a real of this interval and a real of `other`.
        """
        low = None if self.low is None or other.low is None else self.low + other.low
        high = None if self.high is None or other.high is None else self.high + other.high
        return Interval(low, high, self.low_open or other.low_open, self.high_open or other.high_open)

    def subtract(self, other: Interval) -> Interval:
        """Subtract intervals.

        Args:
            other: another interval.

        Returns:
            The differences of a real of this interval and a real of `other`.
        """
        low = None if self.low is None or other.high is None else self.low - other.high
        high = None if self.high is None or other.low is None else self.high - other.low
        return Interval(low, high, self.low_open or other.high_open, self.high_open or other.low_open)

    def scale(self, factor: Fraction) -> Interval:
        """Multiply by a number.

        Args:
            factor: a number other than 0.

        Returns:
            The reals of this interval times `factor`.
        """
        # Nearly all factors are 1 or -1, and fractions are slow.
        if factor == 1:
            return self
        if factor == -1:
            return Interval(
                None if self.high is None else -self.high,
                None if self.low is None else -self.low,
                self.high_open,
                self.low_open,
            )
        low = None if self.low is None else self.low * factor
        high = None if self.high is None else self.high * factor
        if factor > 0:
            return Interval(low, high, self.low_open, self.high_open)
        return Interval(high, low, self.high_open, self.low_open)


def _order(one: Fraction, other: Fraction) -> int:
    """Return a number with the sign of `one - other`; the operators of fractions take thrice as long."""
    return one.numerator * other.denominator - other.numerator * one.denominator
