"""Conversion of exact rationals to doubles that stay inside their range.

The double nearest to 1/10 is larger than 1/10, and bounds are exact. So a value exactly on its bound is
rounded inwards; otherwise it would be denied.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from fractions import Fraction
from math import inf, nextafter
from typing import Any, Final

_LEAST: Final = Fraction(sys.float_info.min)  # normal: doubles below it have fewer digits
_GREATEST: Final = Fraction(sys.float_info.max)


def adjacent_doubles(value: Fraction) -> tuple[float, float]:
    """Return the doubles just below and just above a rational.

    Args:
        value: any rational.

    Returns:
        The largest double <= value and the smallest double >= value: equal if `value` is a double, infinite
        beyond the range of doubles.
    """
    try:
        nearest = float(value)
    except OverflowError:
        largest = nextafter(inf, 0.0)
        return (largest, inf) if value > 0 else (-inf, -largest)
    if Fraction(nearest) == value:
        return nearest, nearest
    if Fraction(nearest) < value:
        return nearest, nextafter(nearest, inf)
    return nextafter(nearest, -inf), nearest


def double_problem(value: Fraction) -> str | None:
    """Say why no double stands for a rational: a run would compute with 0 or infinity in its place.

    Args:
        value: any rational.

    Returns:
        A phrase that completes “it …”; None if the nearest normal double is within its usual precision.
    """
    if value and abs(value) < _LEAST:
        return f"is nearer to 0 than {sys.float_info.min:.2g}, the least number that the robot computes with"
    if abs(value) > _GREATEST:
        return f"is beyond {sys.float_info.max:.2g}, the greatest number that the robot computes with"
    return None


def nearest_double_in_range(value: Fraction, bounds: tuple[Fraction, Fraction] | None) -> float:
    """Round a rational to a double without leaving its range.

    Args:
        value: rational inside the range of doubles.
        bounds: closed range (low, high) in the unit of `value`; None for no range.

    Returns:
        The double nearest to `value`, or the next one inwards where rounding would leave `bounds`. A `value`
        outside `bounds` stays outside.

    Raises:
        OverflowError: `value` is beyond the range of doubles.
    """
    nearest = float(value)
    if bounds is not None:
        lower, upper = bounds
        if value <= upper < Fraction(nearest):
            return nextafter(nearest, -inf)
        if Fraction(nearest) < lower <= value:
            return nextafter(nearest, inf)
    return nearest


def to_doubles(values: Mapping[str, Any]) -> dict[str, Any]:
    """Round all rationals in a mapping to the nearest doubles, for code that does not compute exactly.

    Args:
        values: exact values by name; tuples are converted element by element.

    Returns:
        The same mapping with doubles in place of fractions. Other values stay as they are.
    """
    return {name: _to_double(value) for name, value in values.items()}


def _to_double(value: Any) -> Any:
    if isinstance(value, tuple):
        return tuple(_to_double(part) for part in value)
    return float(value) if isinstance(value, Fraction) else value
