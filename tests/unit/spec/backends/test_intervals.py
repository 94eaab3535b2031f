"""Over intervals, a condition is true or false only if it is at each point of them, for any condition."""

from __future__ import annotations

from fractions import Fraction
from itertools import product
from random import Random

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from aeros.spec.backends.intervals import Interval, Scalar, truth_over
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower
from aeros.spec.expr.parser import parse
from aeros.spec.expr.random_conditions import ConditionCase, cases, to_scalars
from aeros.spec.expr.scope import Scope
from aeros.spec.expr.semantics import Value, is_true
from aeros.spec.expr.typecheck.check import check
from aeros.spec.expr.types import BOOL, EnumType, RealType, Type
from aeros.spec.expr.units import NUMBER

CUP = EnumType("things", ("cup", "lid"))
TYPES: dict[str, Type] = {"x": RealType(NUMBER), "y": RealType(NUMBER), "on": BOOL, "thing": CUP}
STATE = {name: t.Variable(name, type_, t.VariableRole.STATE) for name, type_ in TYPES.items()}
SCOPE = Scope(STATE, {}, {}, {"things": CUP}, {})


def over(text: str, **values: Scalar) -> bool | None:
    return truth_over(lower(check(parse(text), SCOPE, BOOL)), values)


def between(low: float, high: float) -> Interval:
    return Interval(Fraction(low), Fraction(high))


@pytest.mark.parametrize(
    ("text", "x", "y", "truth"),
    [
        ("x >= 2", (2, 3), (0, 0), True),
        ("x > 2", (2, 3), (0, 0), None),
        ("x > 2", (1, 2), (0, 0), False),
        ("x >= 2", (1, 1.5), (0, 0), False),
        ("x == y", (1, 2), (2, 3), None),
        ("x == y", (1, 2), (3, 4), False),
        ("x == y", (1, 1), (1, 1), True),
        ("abs(x - y) <= 3", (1, 2), (-1, 0), True),
        ("abs(x) >= 1", (-2, 2), (0, 0), None),
        ("x * x >= 0", (-2, 1), (0, 0), True),
        ("x * y >= 0", (-2, 1), (1, 1), None),
        ("min(x, y) <= 1", (0, 1), (0, 9), True),
        ("max(x, y) <= 1", (0, 1), (0, 9), None),
        ("(if x <= 1 then y else 5) >= 4", (0, 2), (4, 6), True),
        ("(if x <= 1 then y else 5) >= 4", (0, 2), (3, 6), None),
        ("abs(x) >= 2", (-3, -2), (0, 0), True),
        ("x <= y", (2, 3), (1, 2), None),
        ("x < y", (2, 3), (1, 2), False),
        ("abs(x) <= 1", (-2, 1), (0, 0), None),
        ("x * y >= -1", (1, 2), (-1, 1), None),
        ("x * x >= 1", (-2, 1), (0, 0), None),
        ("(if x <= 1 then 5 else y) >= 4", (0, 2), (3, 6), None),
        ("x >= 9 and y >= 1", (0, 1), (0, 9), False),
        ("x <= 1 or y >= 1", (0, 1), (0, 9), True),
        ("x <= 1 implies y >= 10", (0, 1), (0, 9), False),
        ("not x <= 1", (2, 3), (0, 0), True),
        ("x >= 0 and y >= 0", (0, 1), (0, 9), True),
        ("x >= 0 and y >= 1", (0, 1), (0, 9), None),
        ("x >= 2 or y >= 1", (0, 1), (0, 9), None),
        ("x >= 2 or y >= 10", (0, 1), (0, 9), False),
        ("min(x, y) >= 1", (1, 2), (1, 9), True),
        ("max(x, y) >= 2", (0, 1), (2, 9), True),
        ("max(x, y) <= 9", (0, 1), (2, 9), True),
        ("abs(x) >= 1", (1, 2), (0, 0), True),
        ("abs(x) >= 0", (-2, 2), (0, 0), True),
        ("x * x >= 1", (1, 2), (0, 0), True),
        ("x * y >= 0", (-1, 1), (0, 2), None),
        ("x == y", (1, 1), (2, 2), False),
        ("(if x <= 1 then 2 else y) >= 2", (0, 1), (0, 1), True),
        ("(if x <= 1 then 2 else y) >= 2", (2, 3), (0, 1), False),
    ],
)
def test_it_is_decided_where_all_points_agree(
    text: str, x: tuple[float, float], y: tuple[float, float], *, truth: bool | None
) -> None:
    assert over(text, x=between(*x), y=between(*y)) is truth


def test_the_unknown_decides_only_conditions_that_do_not_depend_on_it() -> None:
    assert over("on", on=None) is None
    assert over("thing == cup", thing=None) is None
    assert over("thing == cup", thing="lid") is False
    assert over("on or x <= 1", on=None, x=between(0, 1)) is True
    assert over("(if on then thing == cup else thing == lid) or not on", on=None, thing="cup") is None
    assert over("(if on then thing else cup) == cup", on=None, thing="cup") is True
    assert over("(if on then thing else cup) == cup", on=None, thing="lid") is None
    assert over("(if on then x else 5) >= 4", on=None, x=between(4, 6)) is True
    assert over("(if on then x <= 1 else x <= 2)", on=None, x=between(0, 1)) is True
    assert over("(if on then x <= 1 else x <= 0)", on=None, x=between(1, 1)) is None


def test_a_number_of_which_nothing_is_known_is_compared_with_nothing_known() -> None:
    for text in ("x <= 1", "1 < x", "x == y", "(if on then x else y) <= 1", "(if on then y else x) <= 1"):
        assert over(text, x=None, y=between(0, 1), on=None) is None
    assert over("(if on then y else x) <= 1", x=None, y=between(0, 1), on=True) is True


NUMBERS = st.recursive(
    st.sampled_from(["x", "y", "-2", "-1", "0", "1", "2"]),
    lambda part: st.one_of(
        st.builds("({} {} {})".format, part, st.sampled_from("+-*"), part),
        st.builds("{}({}, {})".format, st.sampled_from(["min", "max"]), part, part),
        st.builds("abs({})".format, part),
        st.builds("(if {} <= {} then {} else {})".format, part, part, part, part),
    ),
    max_leaves=5,
)
ENDS = st.tuples(st.integers(-2, 2), st.integers(-2, 2)).map(sorted)


@settings(max_examples=500)
@given(left=NUMBERS, op=st.sampled_from(["<", "<=", "=="]), right=NUMBERS, x=ENDS, y=ENDS)
def test_it_agrees_with_the_language_at_each_corner_and_between(
    left: str, op: str, right: str, x: list[int], y: list[int]
) -> None:
    condition = lower(check(parse(f"{left} {op} {right}"), SCOPE, BOOL))
    truth = truth_over(condition, {"x": between(*x), "y": between(*y)})
    points = product(range(x[0], x[1] + 1), range(y[0], y[1] + 1))
    found = {is_true(condition, {"x": Fraction(a), "y": Fraction(b)}) for a, b in points}
    assert truth is None or found == {truth}


@given(case=cases(), drawn=st.randoms())
def test_it_agrees_with_the_language_at_each_point(case: ConditionCase, drawn: Random) -> None:
    intervals: dict[str, Scalar] = {}
    point: dict[str, Value] = {}
    for name, value in to_scalars(case.values).items():
        if isinstance(value, bool | str):
            intervals[name] = point[name] = value
            continue
        middle, radius = Fraction(value), drawn.choice([Fraction(0), Fraction(1, 10), Fraction(2)])
        intervals[name] = Interval(middle - radius, middle + radius)
        point[name] = middle + Fraction(drawn.randint(-4, 4), 4) * radius
    condition = lower(case.term)
    truth = truth_over(condition, intervals)
    assume(truth is not None)
    assert is_true(condition, point) is truth
