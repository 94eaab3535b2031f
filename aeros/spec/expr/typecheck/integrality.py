"""Check that a real term is a whole number for all values of its variables."""

from __future__ import annotations

from fractions import Fraction

from aeros.spec.expr import terms as t
from aeros.spec.expr.types import FamilyType, IntegerType


def is_integral(term: t.Term) -> bool:
    """Say if a term is whole for all values of its variables.

    Args:
        term: real term.

    Returns:
        True if the structure of `term` shows that it is whole; False if not, even where it happens to be
        whole.
    """
    match term:
        case t.Literal(value=Fraction(denominator=1)):
            return True
        case (
            t.Variable(type=IntegerType())
            | t.Select(family=t.Variable(type=FamilyType(element=IntegerType())))
        ):
            return True
        case t.Occurrences() | t.Aggregate(kind="count"):
            return True
        case t.Aggregate(body=part) | t.Absolute(operand=part):
            return is_integral(part)
        case t.Add(left=a, right=b) | t.Multiply(left=a, right=b) | t.Extremum(left=a, right=b):
            return is_integral(a) and is_integral(b)
        case t.Conditional(then=a, otherwise=b):
            return is_integral(a) and is_integral(b)
        case _:
            return False
