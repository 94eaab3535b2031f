"""Constants as terms, from the values of effects, inputs and witnesses."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BoolType, EnumType, RealType, Type, VectorType


def constant_term(value: Any, type_: Type) -> t.Term:
    """Make a term of a value.

    Args:
        value: a scalar, or the three components of a vector; numbers in SI units.
        type_: type of the value.

    Returns:
        A literal, or a vector of literals.

    Raises:
        MisuseError: the type is that of a family, or a vector is given for a scalar.
    """
    if isinstance(type_, VectorType):
        x, y, z = (t.Literal(Fraction(part), RealType(type_.dimension)) for part in value)
        return t.Vector(x, y, z)
    if isinstance(value, tuple) or not isinstance(type_, BoolType | RealType | EnumType):
        raise MisuseError(f"`{value}` is no constant of the type {type_}")
    return t.Literal(value, type_)


def equality_condition(variable: t.Variable, value: Any) -> t.Term:
    """Make the condition that a scalar variable has a value.

    Args:
        variable: scalar variable.
        value: exact value of its type.

    Returns:
        A boolean term.
    """
    if isinstance(value, bool):
        return variable if value else t.Not(variable)
    return t.Compare("==", variable, constant_term(value, variable.type))
