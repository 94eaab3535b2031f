"""Exact rationals as doubles that keep to their range.

The double nearest to 1/10 is larger than 1/10, and every bound is exact; so the value that stands
exactly on its bound is rounded inwards, or it would be denied.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from math import inf, nextafter
from typing import Any


def adjacent_doubles(value: Fraction) -> tuple[float, float]:
    """The largest double <= value and the smallest double >= value; infinite beyond the doubles."""
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


def nearest_double_in_range(value: Fraction, bounds: tuple[Fraction, Fraction] | None) -> float:
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


def to_doubles(values: Mapping[str, Any]) -> dict[str, Any]:
    """Exact values by name as code outside the proofs takes them: every rational as the nearest double."""
    return {name: _to_double(value) for name, value in values.items()}


def _to_double(value: Any) -> Any:
    if isinstance(value, tuple):
        return tuple(_to_double(part) for part in value)
    return float(value) if isinstance(value, Fraction) else value
