"""Checks of a step's inputs and outputs against the skill's declarations: types, ranges, defaults, names."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from math import isfinite
from typing import Any

from aeros.spec.expr.doubles import nearest_double_in_range
from aeros.spec.expr.types import BoolType, EnumType, FamilyType, IntegerType, RealType, VectorType
from aeros.spec.model.variables import Declared


class InputError(Exception):
    """Inputs or outputs differ from what the skill declares; the message says how."""


def check_inputs(declared: Mapping[str, Declared], values: Mapping[str, Any]) -> dict[str, Any]:
    """Check inputs and convert them to the declared types.

    Integers become int, reals float (from float, int or Fraction; a Fraction on its bound stays inside),
    vectors and families (tuple or list) tuples. The result is immutable all the way down, so the checked
    values are the used values.

    Args:
        declared: the skill's inputs, by name.
        values: given values, SI, by name.

    Returns:
        A value of the declared type, SI, for every declared input; defaults fill in missing ones.

    Raises:
        InputError: a value is missing, unknown, of another type or outside its range.
    """
    return _check_values("input", declared, values)


def check_outputs(declared: Mapping[str, Declared], values: Mapping[str, Any]) -> dict[str, Any]:
    """Check outputs and convert them to the declared types, as `check_inputs` does.

    Args:
        declared: the skill's outputs, by name.
        values: returned values, SI, by name.

    Returns:
        A value of the declared type, SI, for every declared output.

    Raises:
        InputError: a value is missing, unknown, of another type or outside its range.
    """
    return _check_values("output", declared, values)


def _check_values(what: str, declared: Mapping[str, Declared], values: Mapping[str, Any]) -> dict[str, Any]:
    try:
        asked = dict(values)
    except Exception:
        raise InputError(f"the {what}s are not a mapping") from None
    unknown = [name for name in asked if type(name) is not str or name not in declared]
    if unknown:
        raise InputError(f"the skill has no {what} {_format_name(unknown[0])}")
    return {
        name: _check_value(f"{what} `{name}`", one, asked.get(name, one.default_value))
        for name, one in declared.items()
    }


def _check_value(name: str, declared: Declared, value: Any) -> Any:
    if value is None:
        raise InputError(f"the {name} is missing")
    match declared.variable.type:
        case VectorType():
            return _check_sequence(name, declared, value, 3)
        case FamilyType(index=index):
            return _check_sequence(name, declared, value, len(index.members))
        case type_:
            return _check_scalar(name, declared, type_, value)


def _check_sequence(name: str, declared: Declared, value: Any, count: int) -> tuple[Any, ...]:
    if type(value) not in (tuple, list) or len(value) != count:
        raise InputError(f"the {name} is not a list of {count} values")
    type_ = declared.variable.type
    element = type_.element if isinstance(type_, FamilyType) else None
    return tuple(_check_scalar(name, declared, element, item) for item in value)


def _check_scalar(
    name: str, declared: Declared, type_: BoolType | RealType | EnumType | None, value: Any
) -> Any:
    match type_:
        case BoolType():
            if type(value) is not bool:
                raise InputError(f"the {name} is not a truth value")
            return value
        case EnumType(members=members):
            if type(value) is not str or value not in members:
                raise InputError(f"the {name} is not one of {', '.join(members)}")
            return value
        case IntegerType():
            return _check_integer(name, _real(name, declared.range, value))
        case _:
            return _real(name, declared.range, value)


def _real(name: str, bounds: tuple[Fraction, Fraction] | None, value: Any) -> float:
    if type(value) not in (float, int, Fraction) or (type(value) is float and not isfinite(value)):
        raise InputError(f"the {name} is not a finite number")
    # Compared exactly: a double is the rational it denotes.
    exact = Fraction(value)
    if bounds is not None and not bounds[0] <= exact <= bounds[1]:
        lower, upper = map(float, bounds)
        raise InputError(f"the {name}{_shown(value)} is outside its range [{lower:.9g}, {upper:.9g}]")
    return nearest_double_in_range(exact, bounds) if bounds is not None else _double(name, exact)


def _shown(value: float | Fraction) -> str:
    """Return a number with 17 digits, as the double 0.45 is more than 45 cm; empty if no double is near."""
    try:
        return f" = {float(value):.17g}"
    except OverflowError:
        return ""


def _check_integer(name: str, value: float) -> int:
    if not value.is_integer():
        raise InputError(f"the {name} is not a whole number")
    return int(value)


def _double(name: str, exact: Fraction) -> float:
    try:
        return float(exact)
    except OverflowError:
        raise InputError(f"the {name} is too large") from None


def _format_name(name: object) -> str:
    return f"`{name[:100]}`" if type(name) is str else "whose name is not a string"
