"""Expansion of functions and norm comparisons into terms.

They can be written in the expression language, but the term language has no nodes for them.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Literal as OneOf
from typing import cast

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
    products = [t.Multiply(t.Component(left, axis), t.Component(right, axis)) for axis in range(3)]
    return t.Add(t.Add(products[0], products[1]), products[2])


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


def compare_norm(op: str, left: t.Term | Norm, right: t.Term | Norm) -> t.Term:
    """Build a comparison with `sqrt(squared)` over the reals, without the root.

    `sqrt(a) <= b` means `0 <= b and a <= b*b`; `b <= sqrt(a)` means `b < 0 or b*b <= a`.

    Args:
        op: `<`, `<=`, `==` or `!=`. The caller has turned `>` and `>=` round by swapping the sides.
        left: left side. At least one side is a `Norm`.
        right: right side.

    Returns:
        Boolean term without roots, equivalent over the reals.
    """
    if isinstance(left, Norm) and isinstance(right, Norm):
        squares = t.Compare(
            cast('OneOf["<", "<=", "=="]', "==" if op == "!=" else op), left.squared, right.squared
        )
        return t.Not(squares) if op == "!=" else squares
    norm, bound = cast("tuple[Norm, t.Term]", (left, right) if isinstance(left, Norm) else (right, left))
    zero = t.Literal(Fraction(0), RealType(norm.dimension))
    square = t.Multiply(bound, bound)
    if op in ("==", "!="):
        equal = t.And((t.Compare("<=", zero, bound), t.Compare("==", norm.squared, square)))
        return t.Not(equal) if op == "!=" else equal
    strict = cast('OneOf["<", "<="]', op)
    if norm is left:  # sqrt(a) < b
        return t.And((t.Compare(strict, zero, bound), t.Compare(strict, norm.squared, square)))
    return t.Or((t.Compare("<", bound, zero), t.Compare(strict, square, norm.squared)))  # b < sqrt(a)
