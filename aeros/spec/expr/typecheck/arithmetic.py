"""Typing rules of sums, products and quotients: dimensions are equal or multiplied."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

from aeros.spec.expr import syntax as s
from aeros.spec.expr import terms as t
from aeros.spec.expr.scope import ExpressionTypeError
from aeros.spec.expr.typecheck.typed_term import (
    TypedTerm,
    require_rational,
    require_real,
    require_same_type,
)
from aeros.spec.expr.types import RealType, VectorType
from aeros.spec.expr.units import NUMBER, Dimension

MINUS_ONE = t.Literal(Fraction(-1), RealType(NUMBER))
"""Factor that turns a subtraction into a sum."""


def add(op: str, left: TypedTerm, right: TypedTerm, extent: s.TextRange) -> TypedTerm:
    """Type a sum or a difference.

    Args:
        op: `+` or `-`.
        left: real or vector.
        right: operand of the same type.
        extent: place of the whole.

    Returns:
        The sum, of the type of both.

    Raises:
        ExpressionTypeError: an operand has no sums, or the types differ.
    """
    relation = "added to" if op == "+" else "subtracted by"
    if not isinstance(left.type, RealType | VectorType):
        raise ExpressionTypeError(
            "AE203", f"{left.type} cannot be {relation} anything", left.extent, label=str(left.type)
        )
    require_same_type(left, right, relation)
    addend = require_rational(right)
    if op == "-":
        addend = t.Multiply(MINUS_ONE, addend)
    return TypedTerm(t.Add(require_rational(left), addend), left.type, extent)


def negate(operand: TypedTerm, extent: s.TextRange) -> TypedTerm:
    """Type `-operand`.

    Args:
        operand: real or vector.
        extent: place of the whole.

    Returns:
        Its product with -1.

    Raises:
        ExpressionTypeError: the operand is neither.
    """
    return scale(MINUS_ONE, NUMBER, operand, extent)


def multiply(left: TypedTerm, right: TypedTerm, extent: s.TextRange) -> TypedTerm:
    """Type a product of two reals, or of a real and a vector in either order.

    Args:
        left: first factor.
        right: second factor.
        extent: place of the whole.

    Returns:
        The product, with the product of both dimensions.

    Raises:
        ExpressionTypeError: neither factor is real, or the other is neither real nor vector.
    """
    if isinstance(left.type, VectorType):
        left, right = right, left
    factor, type_ = require_real(left, "a factor")
    return scale(factor, type_.dimension, right, extent)


def scale(factor: t.Term, dimension: Dimension, operand: TypedTerm, extent: s.TextRange) -> TypedTerm:
    """Type the product of a real with a real or a vector; the product of two literals is a literal.

    Args:
        factor: real term.
        dimension: dimension of the factor.
        operand: real or vector.
        extent: place of the whole.

    Returns:
        The product, with the product of both dimensions.

    Raises:
        ExpressionTypeError: the operand has another type.
    """
    if not isinstance(operand.type, RealType | VectorType):
        raise ExpressionTypeError(
            "AE203", f"{operand.type} cannot be multiplied", operand.extent, label=str(operand.type)
        )
    type_ = replace(operand.type, dimension=operand.type.dimension * dimension)
    term = require_rational(operand)
    match factor, term:
        case t.Literal(value=Fraction() as one), t.Literal(value=Fraction() as other):
            real = RealType(type_.dimension)
            return TypedTerm(t.Literal(one * other, real), real, extent)
    return TypedTerm(t.Multiply(factor, term), type_, extent)


def invert(divisor: TypedTerm) -> tuple[t.Literal, Dimension]:
    """Type the factor `1 / divisor`, by which a division multiplies.

    Args:
        divisor: real constant other than zero.

    Returns:
        The literal `1 / divisor` and its dimension.

    Raises:
        ExpressionTypeError: the divisor is not real, not a constant, or zero.
    """
    term, type_ = require_real(divisor, "a divisor")
    match term:
        case t.Literal(value=Fraction() as number) if number != 0:
            inverse = type_.dimension**-1
            return t.Literal(1 / number, RealType(inverse)), inverse
    raise ExpressionTypeError(
        "AE206",
        "the divisor must be a constant other than zero",
        divisor.extent,
        cure="multiply the other side instead: `a / b <= c` is `a <= c * b` where b is positive",
    )
