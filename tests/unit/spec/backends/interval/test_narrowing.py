"""Narrowing of a variable by a comparison with a bounded, non-linear term."""

from __future__ import annotations

from fractions import Fraction
from typing import Literal

import pytest

from aeros.spec.backends.interval.box import Box
from aeros.spec.backends.interval.formula import OpaqueLiteral
from aeros.spec.backends.interval.interval import Interval
from aeros.spec.backends.interval.narrowing import SearchState, narrow
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import RealType
from aeros.spec.expr.units import NUMBER

X, Y = (t.Variable(name, RealType(NUMBER), t.VariableRole.STATE) for name in "xy")
SQUARE = t.Multiply(Y, Y)  # from 0 to 4
ZERO, FOUR = Fraction(0), Fraction(4)
LOW, HIGH = Fraction(-9), Fraction(9)


@pytest.mark.parametrize(
    ("op", "is_left", "is_true", "left"),
    [
        ("<", True, True, Interval(LOW, FOUR, high_open=True)),
        ("<=", True, True, Interval(LOW, FOUR)),
        ("<", True, False, Interval(ZERO, HIGH)),
        ("<=", True, False, Interval(ZERO, HIGH, low_open=True)),
        ("<", False, True, Interval(ZERO, HIGH, low_open=True)),
        ("<=", False, True, Interval(ZERO, HIGH)),
        ("<", False, False, Interval(LOW, FOUR)),
        ("<=", False, False, Interval(LOW, FOUR, high_open=True)),
    ],
)
def test_a_variable_compared_with_an_opaque_term_is_narrowed_to_its_range(
    op: Literal["<", "<="], is_left: bool, is_true: bool, left: Interval
) -> None:
    term = t.Compare(op, X, SQUARE) if is_left else t.Compare(op, SQUARE, X)
    box: Box = {"x": Interval(LOW, HIGH), "y": Interval(Fraction(-2), Fraction(2))}
    assert narrow(SearchState(box, [], []), [OpaqueLiteral(term, is_true)])
    assert box["x"] == left
