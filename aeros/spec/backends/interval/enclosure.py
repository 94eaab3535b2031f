"""Interval arithmetic: bounds on a term's value over a box."""

from __future__ import annotations

from fractions import Fraction
from typing import TypeAlias

from aeros.spec.backends.interval.box import Box
from aeros.spec.backends.interval.interval import Interval
from aeros.spec.expr import terms as t

_Bounds: TypeAlias = tuple[Fraction, Fraction] | None
"""Lower and upper bound of a term's value, both included; None if none are known."""


def comparison_truth(term: t.Compare, box: Box) -> bool | None:
    """Decide a comparison over a whole box.

    Args:
        term: comparison of real terms of the scalar core.
        box: values of its variables.

    Returns:
        True if it holds everywhere in `box`, False if nowhere; None if that is not known.
    """
    left, right = interval_of(term.left, box), interval_of(term.right, box)
    if left is None or right is None:
        return None
    if term.op == "==":
        apart = left[1] < right[0] or right[1] < left[0]
        return False if apart else True if left[0] == left[1] == right[0] == right[1] else None
    if term.op == "<":
        return True if left[1] < right[0] else False if left[0] >= right[1] else None
    return True if left[1] <= right[0] else False if left[0] > right[1] else None


def interval_of(term: t.Term, box: Box) -> _Bounds:
    """Enclose the value of a real term over a box.

    Args:
        term: real term of the scalar core.
        box: values of its variables.

    Returns:
        Lower and upper bound, both included; None if none are known.
    """
    match term:
        case t.Literal(value=Fraction() as value):
            return value, value
        case t.Variable(name=name):
            values = box[name]
            if not isinstance(values, Interval) or values.low is None or values.high is None:
                return None
            return values.low, values.high
        case t.Absolute(operand=operand):
            inner = interval_of(operand, box)
            if inner is None:
                return None
            ends = sorted(map(abs, inner))
            return (ends[0] if inner[0] >= 0 or inner[1] <= 0 else Fraction(0)), ends[1]
        case t.Add() | t.Multiply() | t.Extremum():
            left, right = interval_of(term.left, box), interval_of(term.right, box)
            return None if left is None or right is None else _combine_intervals(term, left, right)
        case t.Conditional(then=then, otherwise=otherwise):
            left, right = interval_of(then, box), interval_of(otherwise, box)
            return None if left is None or right is None else (min(left[0], right[0]), max(left[1], right[1]))
        case _:
            return None


def _combine_intervals(
    term: t.Add | t.Multiply | t.Extremum, left: tuple[Fraction, Fraction], right: tuple[Fraction, Fraction]
) -> _Bounds:
    match term:
        case t.Add():
            return left[0] + right[0], left[1] + right[1]
        case t.Multiply():
            if term.left == term.right:
                squares = sorted((left[0] ** 2, left[1] ** 2))
                return (Fraction(0) if left[0] < 0 < left[1] else squares[0]), squares[1]
            ends = [a * b for a in left for b in right]
            return min(ends), max(ends)
        case t.Extremum(kind=kind):
            choose = min if kind == "min" else max
            return choose(left[0], right[0]), choose(left[1], right[1])
