"""Boxes of values, and what sums leave of their variables."""

from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.backends.interval.box import (
    Box,
    LinearSum,
    ValueSet,
    declared_interval,
    intersect,
    is_empty,
    pick_value,
    propagate_sums,
    values_in_box,
)
from aeros.spec.backends.interval.interval import Interval
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL, EnumType, IntegerType, RealType, ScalarType
from aeros.spec.expr.units import NUMBER

MODE = EnumType("Mode", ("idle", "move", "stop"))


def variable(type_: ScalarType) -> t.Variable:
    return t.Variable("v", type_, t.VariableRole.STATE)


HELD, IN_MODE = variable(BOOL), variable(MODE)
LEVEL, LAPS = variable(RealType(NUMBER)), variable(IntegerType())


def between(low: int | str, high: int | str) -> Interval:
    return Interval(Fraction(low), Fraction(high))


def total(**factors: int) -> LinearSum:
    return tuple((name, Fraction(factor)) for name, factor in factors.items())


def test_before_any_condition_a_variable_has_every_value_of_its_declaration() -> None:
    ranges = {"v": (Fraction(1), Fraction(2))}
    assert declared_interval(HELD, ranges) == frozenset({False, True})
    assert declared_interval(IN_MODE, ranges) == frozenset({"idle", "move", "stop"})
    assert declared_interval(LEVEL, ranges) == declared_interval(LAPS, ranges) == between(1, 2)
    assert declared_interval(LEVEL, {}) == Interval()


@pytest.mark.parametrize(
    ("of", "values", "picked"),
    [
        (HELD, frozenset({False, True}), False),
        (HELD, frozenset({True}), True),
        (IN_MODE, frozenset({"stop", "move"}), "move"),
        (LEVEL, between(0, 3), Fraction(3, 2)),
        (LAPS, between(0, 3), Fraction(1)),
        (LAPS, between("1/4", "3/4"), Fraction(1, 2)),
    ],
)
def test_one_of_the_values_is_picked(of: t.Variable, values: ValueSet, picked: object) -> None:
    assert pick_value(of, values) == picked


def test_the_value_picked_is_near_the_end_that_is_asked_for() -> None:
    assert (pick_value(LEVEL, between(0, 3), "low"), pick_value(LAPS, between(0, 3), "high")) == (0, 3)


def test_a_sum_leaves_each_variable_what_the_others_allow() -> None:
    box: Box = {"x": between(0, 9), "y": between(0, 9), total(x=1, y=2): between(-5, 4)}
    assert propagate_sums(box)
    assert box == {"x": between(0, 4), "y": between(0, 2), total(x=1, y=2): between(0, 4)}


def test_a_factor_below_zero_turns_the_interval_round() -> None:
    box: Box = {"x": between(5, 9), "y": between(0, 9), total(x=1, y=-3): between(-100, 0)}
    assert propagate_sums(box)
    assert box["y"] == between("5/3", 9)


def test_a_narrowed_variable_narrows_the_sums_before_its_own() -> None:
    box: Box = {name: between(0, high) for name, high in (("x", 10), ("y", 10), ("z", 3))}
    box[total(x=1, y=-1)] = Interval(high=Fraction(0))
    box[total(y=1, z=-1)] = Interval(high=Fraction(0))
    assert propagate_sums(box)
    assert [box[name] for name in "xyz"] == [between(0, 3)] * 3


def test_a_sum_that_no_values_have_empties_the_box() -> None:
    assert not propagate_sums({"x": between(0, 1), "y": between(0, 1), total(x=1, y=1): between(3, 4)})
    assert propagate_sums({"x": between(0, 1), "y": between(0, 1), total(x=1, y=1): between(2, 4)})


def test_a_box_without_sums_stays_as_it_is() -> None:
    box: Box = {"x": between(0, 1), "held": frozenset({True})}
    assert propagate_sums(box)
    assert box == {"x": between(0, 1), "held": {True}}


def test_two_sets_of_values_have_what_both_have() -> None:
    assert intersect(between(0, 3), between(2, 5)) == between(2, 3)
    assert intersect(frozenset({"idle", "move"}), frozenset({"move", "stop"})) == frozenset({"move"})


def test_a_set_is_empty_without_values() -> None:
    assert [
        is_empty(one) for one in (between(1, 1), between(2, 1), frozenset({False}), frozenset[str]())
    ] == [
        False,
        True,
        False,
        True,
    ]


def test_the_values_of_a_sum_are_those_listed_or_else_those_of_its_variables() -> None:
    of = total(x=1, y=-2)
    box: Box = {"x": between(0, 1), "y": between(2, 4)}
    assert (values_in_box("x", box), values_in_box(of, box)) == (between(0, 1), between(-8, -3))
    assert values_in_box(of, {**box, of: between(-5, -4)}) == between(-5, -4)


_ENDS = st.tuples(st.integers(-5, 5), st.integers(-5, 5)).map(sorted)


@given(x=_ENDS, y=_ENDS, s=_ENDS, factor=st.integers(-3, 3).filter(bool))
def test_no_point_of_the_box_that_has_the_sum_is_lost(
    x: list[int], y: list[int], s: list[int], factor: int
) -> None:
    box: Box = {"x": between(*x), "y": between(*y), total(x=1, y=factor): between(*s)}
    is_possible = propagate_sums(box)
    for a in range(x[0], x[1] + 1):
        for b in range(y[0], y[1] + 1):
            if s[0] <= a + factor * b <= s[1]:
                assert is_possible
                assert not is_empty(intersect(box["x"], between(a, a)))
                assert not is_empty(intersect(box["y"], between(b, b)))
