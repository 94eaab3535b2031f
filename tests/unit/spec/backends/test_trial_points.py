from __future__ import annotations

from fractions import Fraction

import pytest

from aeros.spec.backends import trial_points
from aeros.spec.backends.solver_results import Question
from aeros.spec.backends.trial_points import MAX_NUMBERS, _values, find_point
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import values_by_variable
from aeros.spec.expr.parser import parse
from aeros.spec.expr.random_terms import VARIABLES
from aeros.spec.expr.scope import Scope
from aeros.spec.expr.semantics import is_true
from aeros.spec.expr.typecheck.check import check
from aeros.spec.expr.types import BOOL, RealType
from aeros.spec.expr.units import LENGTH

_RANGES = dict.fromkeys(
    ("x", "y", *(f"{one}.{axis}" for one in "pq" for axis in "xyz")), (Fraction(-10), Fraction(10))
)


def question(*texts: str) -> Question:
    terms = [check(parse(text), Scope(VARIABLES), BOOL) for text in texts]
    return Question(list(t.variables_of(t.And(tuple(terms))).values()), _RANGES, terms)


@pytest.mark.parametrize(
    "texts",
    [
        ("x * y == 6 m*m", "x == 2 m", "y == 3 m"),
        ("norm(p) <= 1 m", "distance(p, q) <= 2 m", "norm(q) >= 3 m"),
        ("x >= 0 m",),
    ],
)
def test_a_point_meets_all_conditions(texts: tuple[str, ...]) -> None:
    asked = question(*texts)
    point = find_point(asked)
    assert point is not None
    values = values_by_variable(asked.variables, point)
    assert all(is_true(one, values) for one in asked.terms)


def test_without_a_point_among_the_values_that_are_tried_there_is_none() -> None:
    assert find_point(question("norm(p) <= 1 m", "distance(p, q) <= 2 m", "norm(q) >= 3.1 m")) is None


@pytest.mark.parametrize(
    ("low", "high", "first"), [(4, 10, 4), (-10, -4, -4), (-1, 1, 0), (0, 9, 0), (-9, 0, 0), (None, None, 0)]
)
def test_a_range_is_begun_at_0_or_at_its_nearest_end(low: int | None, high: int, first: int) -> None:
    ranges = {} if low is None else {"x": (Fraction(low), Fraction(high))}
    assert find_point(question("x <= 10 m")._replace(ranges=ranges)) == {"x": Fraction(first)}


def test_the_search_ends_after_so_many_points(monkeypatch: pytest.MonkeyPatch) -> None:
    tried: list[object] = []
    monkeypatch.setattr(trial_points, "is_true", lambda _, point: tried.append(point))
    monkeypatch.setattr(trial_points, "MAX_POINTS", 5)
    assert find_point(question("x * y * 2 == 7 m*m")) is None
    assert len(tried) == 5


def test_other_variables_than_real_numbers_are_left_to_the_solver() -> None:
    assert find_point(question("a")) is None
    assert find_point(question("laps >= 0")) is None


def test_many_variables_are_left_to_the_solver() -> None:
    many = [
        t.Variable(f"n{number}", RealType(LENGTH), t.VariableRole.STATE) for number in range(MAX_NUMBERS + 1)
    ]
    assert find_point(Question(many, {}, [])) is None
    assert find_point(Question(many[1:], {}, [])) is not None


@pytest.mark.parametrize("end", ["x >= 10 m", "x <= -10 m"])
def test_the_ends_of_a_range_are_in_it(end: str) -> None:
    assert find_point(question(end)) == {"x": Fraction(10 if ">" in end else -10)}
    assert find_point(question(end.replace("10", "10.5"))) is None


@pytest.mark.parametrize(
    ("texts", "sizes"),
    [
        (("x >= 2 m", "y <= -3 m"), ["2", "3", "5"]),
        (("x * y <= 9 m*m", "x >= 2 m"), ["3", "2", "9", "5", "12", "11"]),  # the root of 9 is first
        (("x * 0.25 m <= 0.0625 m*m",), ["1/2", "1/4", "1/16", "3/4", "9/16", "5/16"]),
        (
            ("x >= 7 m", "x >= 0.5 m", "y >= 0.75 m", "y >= 3 m", "x >= 8 m"),
            ["1/2", "3", "3/4", "7", "7/2", "5/4"],
        ),
        (("x >= 0 m",), []),
    ],
)
def test_values_to_try_are_roots_and_simple_constants_and_their_sums(
    texts: tuple[str, ...], sizes: list[str]
) -> None:
    tried = _values(question(*texts).terms)
    assert tried == [sign * Fraction(size) for size in sizes for sign in (1, -1)]
