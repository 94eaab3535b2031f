"""Reals that are tried of an interval."""

from __future__ import annotations

from fractions import Fraction

from aeros.spec.backends.interval.interval import Interval


def test_an_end_that_is_in_it_is_near_itself() -> None:
    values = Interval(Fraction(0), Fraction(8))
    assert [values.pick_near("low"), values.pick_near("high")] == [0, 8]


def test_near_an_end_that_is_not_in_it_is_an_eighth_of_the_way_to_the_other() -> None:
    values = Interval(Fraction(0), Fraction(8), low_open=True, high_open=True)
    assert [values.pick_near("low"), values.pick_near("high")] == [1, 7]


def test_near_no_end_or_one_that_is_not_there_is_the_middle() -> None:
    assert Interval(Fraction(0), Fraction(8)).pick_near(None) == 4
    below = Interval(None, Fraction(8))
    assert below.pick_near("low") == below.midpoint()
