from __future__ import annotations

from fractions import Fraction

import pytest

from aeros.spec.expr.doubles import double_within


@pytest.mark.parametrize("value", [Fraction(1, 10), Fraction(7, 100), Fraction(1, 3), Fraction(0)])
def test_a_bound_as_a_double_stays_inside(value: Fraction) -> None:
    assert Fraction(double_within(value, (Fraction(-1), value))) <= value
    assert Fraction(double_within(value, (value, Fraction(1)))) >= value
    assert double_within(value, (Fraction(-1), Fraction(1))) == double_within(value, None) == float(value)
