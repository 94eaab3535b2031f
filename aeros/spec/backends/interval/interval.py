"""Intervals of reals, with open, closed or no ends, exactly."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from math import ceil, floor
from typing import Literal, TypeAlias

End: TypeAlias = Literal["low", "high"] | None
"""Where in an interval a number is taken from; None: from its middle."""


@dataclass(frozen=True, slots=True)
class Interval:
    """The reals between two ends, either of which may be open, or None for endless."""

    low: Fraction | None = None
    high: Fraction | None = None
    low_open: bool = False
    high_open: bool = False

    @property
    def is_empty(self) -> bool:
        """Whether no real is in it."""
        if self.low is None or self.high is None:
            return False
        return self.low > self.high or (self.low == self.high and (self.low_open or self.high_open))

    def intersect(self, other: Interval) -> Interval:
        """What is in both."""
        low, low_open = self.low, self.low_open
        if other.low is not None and (low is None or other.low >= low):
            low, low_open = other.low, other.low_open or (low == other.low and low_open)
        high, high_open = self.high, self.high_open
        if other.high is not None and (high is None or other.high <= high):
            high, high_open = other.high, other.high_open or (high == other.high and high_open)
        return Interval(low, high, low_open, high_open)

    def midpoint(self) -> Fraction:
        """One of its reals, halfway between the ends where there are two."""
        if self.low is None:
            return Fraction(0) if self.high is None else self.high - 1
        return self.low + 1 if self.high is None else (self.low + self.high) / 2

    def pick_near(self, end: End) -> Fraction:
        """One of its reals: that end if it is in it, else one an eighth of the way to the other end."""
        if self.low is None or self.high is None or end is None:
            return self.midpoint()
        if end == "low":
            return self.low + (self.high - self.low) / 8 if self.low_open else self.low
        return self.high - (self.high - self.low) / 8 if self.high_open else self.high

    def pick_integer(self, end: End = None) -> Fraction:
        """One of its whole numbers; if there is none where a real is taken from, that real."""
        middle = self.pick_near(end)
        near = (Fraction(floor(middle)), Fraction(ceil(middle)))
        return next((one for one in near if not self.intersect(Interval(one, one)).is_empty), middle)

    def add(self, other: Interval) -> Interval:
        """The sums of one of its reals and one of the other's."""
        low = None if self.low is None or other.low is None else self.low + other.low
        high = None if self.high is None or other.high is None else self.high + other.high
        return Interval(low, high, self.low_open or other.low_open, self.high_open or other.high_open)

    def subtract(self, other: Interval) -> Interval:
        """The differences of one of its reals and one of the other's."""
        low = None if self.low is None or other.high is None else self.low - other.high
        high = None if self.high is None or other.low is None else self.high - other.low
        return Interval(low, high, self.low_open or other.high_open, self.high_open or other.low_open)

    def scale(self, factor: Fraction) -> Interval:
        """Each of its reals times `factor`, which is not 0."""
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
