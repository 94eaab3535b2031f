"""Exact rationals as doubles that keep to their range.

The double nearest to 1/10 is larger than 1/10, and every bound is exact; so the value that stands
exactly on its bound is rounded inwards, or it would be denied.
"""

from __future__ import annotations

from fractions import Fraction
from math import inf, nextafter


def double_within(value: Fraction, bounds: tuple[Fraction, Fraction] | None) -> float:
    """The double nearest to `value`, or the next one inwards where rounding would leave the closed `bounds`.

    A `value` outside `bounds` stays outside.
    """
    nearest = float(value)
    if bounds is not None:
        lower, upper = bounds
        if value <= upper < Fraction(nearest):
            return nextafter(nearest, -inf)
        if Fraction(nearest) < lower <= value:
            return nextafter(nearest, inf)
    return nearest
