"""Check a given value against its declaration and make it exact, or say why it is unusable."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import lru_cache
from typing import Any, cast

from aeros.spec.expr.effects import Increment
from aeros.spec.expr.semantics import Value
from aeros.spec.expr.types import BoolType, EnumType, FamilyType, IntegerType, RealType, Type, VectorType
from aeros.spec.model.ecm import Outcome
from aeros.spec.model.variables import Declared


class UnusableValueError(Exception):
    """A value that does not fit its declaration; the message completes “`NAME` …”."""


def to_exact(declared: Declared, value: Any) -> Value:
    """Convert a value to one that `semantics.py` computes with; a finite double is the rational it denotes.

    Look-alikes (a `bool` for a number, a subclass of `float`) are refused, because they may define
    comparison.

    Args:
        declared: declaration of the variable.
        value: value in SI units.

    Returns:
        The exact value.

    Raises:
        UnusableValueError: the value is of another type, not finite or out of range.
    """
    return _exact(declared, declared.variable.type, value)


ExactConverter = Callable[[Declared, Any], Value]
"""Function that converts a measured value to its exact form."""


class CachingConverter:
    """`to_exact` with a cache of the last value of each variable, reused if the same object comes again."""

    def __init__(self) -> None:
        self._kept: dict[str, tuple[Declared, Any, Value]] = {}

    def __call__(self, declared: Declared, value: Any) -> Value:
        """Convert as `to_exact` does.

        Args:
            declared: declaration of the variable.
            value: value in SI units.

        Returns:
            The exact value.

        Raises:
            UnusableValueError: as `to_exact` does.
        """
        name = declared.variable.name
        kept = self._kept.get(name)
        # A list may hold other values by now.
        if kept is not None and kept[0] is declared and kept[1] is value and type(value) is not list:
            return kept[2]
        found = to_exact(declared, value)
        self._kept[name] = (declared, value, found)
        return found


def to_json_value(value: Any) -> Any:
    """Convert a value for JSON: rationals to the nearest double, tuples to lists.

    Args:
        value: exact value, or a tuple of such.

    Returns:
        The JSON value.
    """
    if isinstance(value, Fraction):
        return float(value)
    return [to_json_value(part) for part in value] if isinstance(value, tuple) else value


def effects_for_reading(outcome: Outcome) -> dict[str, Any]:
    """Write the effects of an outcome for a person or a language model.

    Args:
        outcome: the outcome.

    Returns:
        JSON values by state variable; `+= 1` for an increment, `in [0.38, 0.42]` for a range, SI.
    """
    effects = {
        name: str(effect) if isinstance(effect, Increment) else to_json_value(effect)
        for name, effect in outcome.effects.items()
    }
    return effects | {one.name: str(one) for one in outcome.ranges}


def _exact(declared: Declared, type_: Type, value: Any) -> Value:
    match type_:
        case BoolType() if type(value) is bool:
            return value
        case RealType() if type(value) in (float, int, Fraction):
            number = _real(declared, value)
            if isinstance(type_, IntegerType) and number.denominator != 1:
                raise UnusableValueError("is not a whole number")
            return number
        case EnumType(members=members) if type(value) is str:
            if value not in members:
                raise UnusableValueError(f"is {value!r}, which is none of {', '.join(members)}")
            return value
        case VectorType(dimension=dimension) if type(value) in (tuple, list) and len(value) == 3:
            return _tuple(declared, RealType(dimension), value)
        case FamilyType(index=index, element=element) if type(value) is tuple and len(value) == len(
            index.members
        ):
            return _tuple(declared, element, value)
    raise UnusableValueError(f"is of type {type(value).__name__}, which is not {type_}")


def _real(declared: Declared, value: float | Fraction) -> Fraction:
    if isinstance(value, float) and not math.isfinite(value):
        raise UnusableValueError("is not finite")
    # Doubles are compared with each other a good deal faster than with fractions.
    low, high = declared.double_range if isinstance(value, float) else declared.range or declared.double_range
    if not low <= value <= high:
        raise UnusableValueError(f"is outside {float(low):g} … {float(high):g} (SI)")
    return _rational(value)


_rational = lru_cache(maxsize=4096)(Fraction)
"""Fractions of the numbers that are measured again and again."""


def _tuple(declared: Declared, element: BoolType | RealType, parts: Sequence[Any]) -> Value:
    return cast("Value", tuple(_exact(declared, element, part) for part in parts))
