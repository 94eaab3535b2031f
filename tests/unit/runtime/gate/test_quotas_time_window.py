from __future__ import annotations

from fractions import Fraction
from math import inf, nextafter
from random import Random

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from aeros.runtime.gate.quotas import TimeWindow

TIMES = st.floats(-(2.0**53), 2.0**53)
LENGTHS = st.fractions(0, 10**6) | st.sampled_from([Fraction(0), Fraction(1, 10), Fraction(10) ** 400])


@given(LENGTHS, TIMES, st.floats(0, 1e6))
@example(Fraction(1, 10), 1.0, 0.1)
@example(Fraction(1), 1e-30, 1.0)
@example(Fraction(1), -1e-30, 1.0)
def test_a_window_agrees_with_exact_arithmetic(length: Fraction, earlier: float, apart: float) -> None:
    window = TimeWindow(length)
    for later in (earlier + apart, earlier + float(min(length, Fraction(10**6))), earlier):
        for one in (nextafter(later, -inf), later, nextafter(later, inf)):
            assert window.contains(earlier, one) is (Fraction(one) - Fraction(earlier) <= length)


@pytest.mark.parametrize("length", [0.0, 0.25, 10.0, 5000.0])
def test_rounding_of_the_difference_does_not_change_the_result(length: float) -> None:
    window, differing = TimeWindow(Fraction(length)), 0
    chance = Random(4)  # noqa: S311 - a test, the same every time
    for _ in range(5000):
        earlier = chance.uniform(-1, 1) * 2.0 ** chance.randint(-60, 13)
        later = earlier + length
        for one in (nextafter(later, -inf), later, nextafter(later, inf)):
            exactly = Fraction(one) - Fraction(earlier) <= length
            assert window.contains(earlier, one) is window.contains_exactly(earlier, one) is exactly
            differing += (one - earlier <= length) is not exactly
    assert differing > 100 or length == 0.0


@pytest.mark.parametrize("length", [Fraction(0), Fraction(1, 10), Fraction(10) ** 400])
def test_minus_infinity_is_in_no_window(length: Fraction) -> None:
    assert not TimeWindow(length).contains(-inf, 0.0)
