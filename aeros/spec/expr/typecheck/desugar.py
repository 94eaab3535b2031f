"""Expansion of functions and norm comparisons into terms.

They can be written in the expression language, but the term language has no nodes for them.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Literal as OneOf

from aeros.spec.expr import terms as t
from aeros.spec.expr.types import RealType
from aeros.spec.expr.units import Dimension

ARITY = {"abs": 1, "norm": 1, "min": 2, "max": 2, "distance": 2, "dot": 2, "vec": 3, "clamp": 3}
"""Number of arguments of each function."""


@dataclass(frozen=True, slots=True)
class Norm:
    """Irrational value, the root of a real. Only a comparison may consume it.

    Attributes:
        squared: term of the square of the value.
        dimension: dimension of the value itself.
    """

    squared: t.Term
    dimension: Dimension


def dot(left: t.Term, right: t.Term) -> t.Term:
    """Build the scalar product of two vectors.

    Args:
        left: vector term.
        right: vector term.

    Returns:
        Real term, the sum of the three products of components.
    """
    x, y, z = (t.Multiply(t.Component(left, axis), t.Component(right, axis)) for axis in range(3))
    return t.Add(t.Add(x, y), z)


def expand_function(name: str, arguments: list[t.Term]) -> t.Term:
    """Build the term for a call of a function of real numbers.

    Args:
        name: `abs`, `min`, `max`, `clamp` or `vec`.
        arguments: real terms, as many as `ARITY` says, of one dimension.

    Returns:
        Real term, or the vector term of `vec`.
    """
    match name:
        case "abs":
            return t.Absolute(arguments[0])
        case "min":
            return t.Extremum("min", arguments[0], arguments[1])
        case "max":
            return t.Extremum("max", arguments[0], arguments[1])
        case "clamp":
            return t.Extremum("min", t.Extremum("max", arguments[0], arguments[1]), arguments[2])
        case _:
            return t.Vector(arguments[0], arguments[1], arguments[2])


Relation = OneOf["<", "<=", "=="]
"""Relation of a comparison; the others are turned round, or negated."""


def compare_terms(relation: Relation, left: t.Term | Norm, right: t.Term | Norm) -> t.Term:
    """Build a comparison of terms and of `sqrt(squared)`, over the reals and without the root.

    `sqrt(a) <= b` means `0 <= b and a <= b*b`; `b <= sqrt(a)` means `b < 0 or b*b <= a`.

    Args:
        relation: the relation.
        left: left side.
        right: right side, of the same type.

    Returns:
        Boolean term without roots, equivalent over the reals.
    """
    if isinstance(right, Norm):
        if isinstance(left, Norm):
            return t.Compare(relation, left.squared, right.squared)
        if relation == "==":
            return compare_terms(relation, right, left)
        zero, square = _zero_and_square(right, left)
        return t.Or((t.Compare("<", left, zero), t.Compare(relation, square, right.squared)))  # b < sqrt(a)
    if isinstance(left, Norm):  # sqrt(a) < b
        zero, square = _zero_and_square(left, right)
        return t.And((t.Compare("<=", zero, right), t.Compare(relation, left.squared, square)))
    return t.Compare(relation, left, right)


def _zero_and_square(norm: Norm, bound: t.Term) -> tuple[t.Term, t.Term]:
    """Return 0 in the norm's unit, and the square of what it is compared with."""
    return t.Literal(Fraction(0), RealType(norm.dimension)), t.Multiply(bound, bound)
