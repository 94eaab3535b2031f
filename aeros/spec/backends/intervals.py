"""Value of a condition when its numbers are known only to lie in intervals.

Interval arithmetic (Moore, Kearfott, Cloud, Introduction to Interval Analysis, 2009, chapter 2) over the
scalar core, in exact rationals. An interval may come out too wide, as each occurrence of a variable counts
for itself, so the answer may be “unknown” where it is one truth value; it is never the wrong one.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any, NamedTuple

from aeros.spec.expr import terms as t


class Interval(NamedTuple):
    """Closed interval of numbers, SI.

    Attributes:
        low: its lower end.
        high: its upper end, at least `low`.
    """

    low: Fraction
    high: Fraction


Scalar = Interval | bool | str | None
"""Interval of a number, truth value, or member of an enum; None for one that is unknown."""


def truth_over(term: t.Term, values: Mapping[str, Scalar]) -> bool | None:
    """Evaluate a condition at all values that its variables may have.

    Args:
        term: boolean term of the scalar core, as `lower` returns it.
        values: value of each variable by name.

    Returns:
        True if it holds at all of them, False if it fails at all of them, None if neither was shown.
    """
    match term:
        case t.Not(operand=operand):
            value = truth_over(operand, values)
            return None if value is None else not value
        case t.And(operands=operands):
            return _all([truth_over(one, values) for one in operands])
        case t.Or(operands=operands):
            return _any([truth_over(one, values) for one in operands])
        case t.Compare(op=op, left=left, right=right):
            return _compare(op, _value(left, values), _value(right, values))
        case _:
            truth: bool | None = _value(term, values)
            return truth


def _value(term: t.Term, values: Mapping[str, Scalar]) -> Any:
    """Return the value of a term of any type, a `Scalar`."""
    match term:
        case t.Literal(value=value):
            return Interval(value, value) if isinstance(value, Fraction) else value
        case t.Variable(name=name):
            return values[name]
        case t.Conditional(condition=condition, then=then, otherwise=otherwise):
            holds = truth_over(condition, values)
            if holds is not None:
                return _value(then if holds else otherwise, values)
            return _either(_value(then, values), _value(otherwise, values))
        case t.Add(left=left, right=right):
            (a, b), (c, d) = _number(left, values), _number(right, values)
            return Interval(a + c, b + d)
        case t.Multiply(left=left, right=right):
            return _multiply(_number(left, values), _number(right, values), is_square=left == right)
        case t.Extremum(kind=kind, left=left, right=right):
            (a, b), (c, d) = _number(left, values), _number(right, values)
            return Interval(min(a, c), min(b, d)) if kind == "min" else Interval(max(a, c), max(b, d))
        case t.Absolute(operand=operand):
            low, high = _number(operand, values)
            return Interval(max(low, -high, Fraction(0)), max(-low, high))
        case _:
            return truth_over(term, values)


def _number(term: t.Term, values: Mapping[str, Scalar]) -> Interval:
    interval: Interval = _value(term, values)
    return interval


def _multiply(left: Interval, right: Interval, *, is_square: bool) -> Interval:
    ends = [a * b for a in left for b in right]
    # The two factors of a square are one number, so it is not negative.
    low = max(Fraction(0), min(ends)) if is_square else min(ends)
    return Interval(low, max(ends))


def _compare(op: str, left: Scalar, right: Scalar) -> bool | None:
    if not isinstance(left, Interval) or not isinstance(right, Interval):
        return None if left is None or right is None else left == right
    if op == "==":
        if left.high < right.low or right.high < left.low:
            return False
        return True if left.low == left.high == right.low == right.high else None
    strictly = op == "<"
    if (left.high < right.low) if strictly else (left.high <= right.low):
        return True
    return False if ((left.low >= right.high) if strictly else (left.low > right.high)) else None


def _either(one: Scalar, other: Scalar) -> Scalar:
    if isinstance(one, Interval) and isinstance(other, Interval):
        return Interval(min(one.low, other.low), max(one.high, other.high))
    return one if one == other else None


def _all(truths: list[bool | None]) -> bool | None:
    return False if False in truths else None if None in truths else True


def _any(truths: list[bool | None]) -> bool | None:
    return True if True in truths else None if None in truths else False
