"""The bounds of a term are the least interval of its values."""

from __future__ import annotations

import itertools
from fractions import Fraction
from typing import cast

import pytest

from aeros.spec.backends.interval.box import Box
from aeros.spec.backends.interval.enclosure import interval_of
from aeros.spec.backends.interval.interval import Interval
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import evaluate
from aeros.spec.expr.types import BOOL, RealType
from aeros.spec.expr.units import NUMBER

REAL = RealType(NUMBER)
X, Y = (t.Variable(name, REAL, t.VariableRole.STATE) for name in "xy")
A = t.Variable("a", BOOL, t.VariableRole.STATE)
THREE, MINUS_TWO = (t.Literal(Fraction(number), REAL) for number in (3, -2))
TERMS: dict[str, t.Term] = {
    "constant": THREE,
    "variable": X,
    "absolute": t.Absolute(X),
    "sum": t.Add(X, Y),
    "product": t.Multiply(X, Y),
    "square": t.Multiply(X, X),
    "multiple": t.Multiply(MINUS_TWO, X),
    "least": t.Extremum("min", X, Y),
    "greatest": t.Extremum("max", X, Y),
    "chosen": t.Conditional(A, X, Y),
    "in one another": t.Add(t.Absolute(X), t.Extremum("min", Y, THREE)),
}
ENDS = ((-3, -1), (-2, 1), (-1, 2), (0, 2), (1, 4), (2, 2))
OPEN = tuple(itertools.product((False, True), repeat=4))


def _critical(ends: tuple[int, int]) -> set[int]:
    """List the points at which a term with a single variable, or its square, is least or greatest."""
    return {*ends, 0} if ends[0] < 0 < ends[1] else set(ends)


def _between(ends: tuple[int, int]) -> Interval:
    return Interval(Fraction(ends[0]), Fraction(ends[1]))


@pytest.mark.parametrize("term", TERMS.values(), ids=TERMS)
def test_bounds_are_the_least_and_the_greatest_value(term: t.Term) -> None:
    for of_x, of_y in itertools.product(ENDS, repeat=2):
        values = [
            cast("Fraction", evaluate(term, {"x": Fraction(x), "y": Fraction(y), "a": a}))
            for x, y, a in itertools.product(_critical(of_x), _critical(of_y), (False, True))
        ]
        box: Box = {"x": _between(of_x), "y": _between(of_y)}
        assert interval_of(term, box) == (min(values), max(values))


def _has(interval: Interval, value: Fraction) -> bool:
    return not interval.intersect(Interval(value, value)).is_empty


@pytest.mark.parametrize("is_open", OPEN)
def test_an_end_of_a_sum_is_reached_iff_both_ends_are(is_open: tuple[bool, bool, bool, bool]) -> None:
    low, high = Fraction(1), Fraction(2)
    one, other = Interval(low, high, *is_open[:2]), Interval(low, high, *is_open[2:])
    total = one.add(other)
    for end in (low, high):
        assert _has(total, 2 * end) is (_has(one, end) and _has(other, end))
        for factor in (-3, 3):
            assert _has(one.scale(Fraction(factor)), factor * end) is _has(one, end)
    assert _has(total, Fraction(3))
    assert not _has(total, Fraction(199, 100))
    assert not _has(total, Fraction(401, 100))
