from __future__ import annotations

from fractions import Fraction

import pytest

from aeros.spec.expr.doubles import nearest_double_in_range


@pytest.mark.parametrize("value", [Fraction(1, 10), Fraction(7, 100), Fraction(1, 3), Fraction(0)])
def test_a_bound_as_a_double_stays_inside(value: Fraction) -> None:
    assert Fraction(nearest_double_in_range(value, (Fraction(-1), value))) <= value
    assert Fraction(nearest_double_in_range(value, (value, Fraction(1)))) >= value
    assert (
        nearest_double_in_range(value, (Fraction(-1), Fraction(1)))
        == nearest_double_in_range(value, None)
        == float(value)
    )
