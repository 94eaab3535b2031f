from __future__ import annotations

import math
from fractions import Fraction

import pytest
from hypothesis import given

from aeros.spec.backends import violation_search
from aeros.spec.backends.lemmas import lemmas_for
from aeros.spec.backends.solver_results import Question
from aeros.spec.backends.violation_search import MAX_PARTS, search
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower, scalar_variables, values_by_variable
from aeros.spec.expr.parser import parse
from aeros.spec.expr.random_conditions import ConditionCase, cases
from aeros.spec.expr.random_terms import VARIABLES
from aeros.spec.expr.scope import ExpressionTypeError, Scope
from aeros.spec.expr.semantics import is_true
from aeros.spec.expr.typecheck.check import check
from aeros.spec.expr.types import BOOL, IntegerType
from tests.hypothesis_profiles import examples


def question(*texts: str) -> Question:
    return asked(*(check(parse(text), Scope(VARIABLES), BOOL) for text in texts))


def asked(*terms: t.Term) -> Question:
    variables = list(t.variables_of(t.And(terms)).values())
    names = [part.name for one in variables for part in scalar_variables(one) if part.type != BOOL]
    return Question(variables, dict.fromkeys(names, (Fraction(-10), Fraction(10))), list(terms))


@pytest.mark.parametrize(
    "texts",
    [
        ("x >= 0 m",),
        ("x == 1.25 m",),
        ("x * y == 6 m*m", "x == 2 m"),
        ("norm(p) <= 1 m", "distance(p, q) <= 2 m", "norm(q) >= 2.999 m"),
        ("dot(p, q) >= 0.999 m*m", "norm(p) <= 1 m", "norm(q) <= 1 m"),
        ("abs(x) + abs(y) >= 19.9 m",),
        ("max(x, y) <= -1 m", "min(x, y) >= -2 m"),
        ("a", "not b", "b or x >= 5 m"),
        ("a == b", "b == (x > 2 m)", "x >= 3 m"),
        ("a != b", "a implies x > 2 m", "b implies x < -2 m"),
        ("if a then x >= 2 m else x <= -2 m", "x == -3 m"),
        ("(if x >= 0 m then x else y) >= 4 m", "x <= -1 m"),
        ("x != y", "x + y == 0 m"),
    ],
)
def test_a_point_that_meets_all_conditions_is_found(texts: tuple[str, ...]) -> None:
    wanted = question(*texts)
    found = search(wanted).found
    assert found is not None
    values = values_by_variable(wanted.variables, found)
    assert all(is_true(one, values) for one in wanted.terms)


def test_whole_numbers_stay_whole() -> None:
    number = t.Variable("n", IntegerType(), t.VariableRole.STATE)
    half = t.Literal(Fraction(5, 2), IntegerType())
    found = search(asked(t.Compare("<=", half, number))).found
    assert found is not None
    assert Fraction(found["n"]).denominator == 1


def test_where_nothing_can_hold_the_nearest_point_is_known() -> None:
    result = search(question("norm(p) <= 1 m", "norm(p) >= 3 m"))
    assert result.found is None
    length = sum(result.nearest[f"p.{axis}"] ** 2 for axis in "xyz")
    assert 1 < length < 9


@examples(60)
@given(cases())
def test_a_point_that_is_found_meets_the_conditions(case: ConditionCase) -> None:
    wanted = asked(case.term)
    found = search(wanted).found
    if found is not None:
        assert is_true(case.term, values_by_variable(wanted.variables, found))


@pytest.mark.parametrize(
    "text",
    [
        "n * n * n * n * n * n * n * n >= 1e300",  # a residual whose square is no double
        "n * n * 1e-170 >= 1e-165",  # slopes whose product is no double
        "n * 1e-200 >= 1",
        "n >= 1e309",  # a constant that is no double
        "n * laps >= 1e310 and laps <= -1e309",
        "1e310 * n * (1e310 * n + 1) <= -1",
    ],
)
def test_numbers_beyond_doubles_raise_no_error(text: str) -> None:
    unbounded = question(text)._replace(ranges={})
    point = search(unbounded)
    if point.found is not None:
        assert is_true(unbounded.terms[0], point.found)
    for lemma in lemmas_for(unbounded.terms, near=point.nearest):
        assert is_true(lemma, dict.fromkeys(("n", "laps"), Fraction(3)))


@pytest.mark.parametrize(
    "bounds", [(Fraction(10) ** 310, Fraction(10) ** 311), (-(Fraction(10) ** 311), Fraction(0))]
)
def test_a_range_beyond_doubles_raises_no_error(bounds: tuple[Fraction, Fraction]) -> None:
    found = search(question("n * n >= 1 and a")._replace(ranges={"n": bounds})).found
    assert found is None or bounds[0] <= Fraction(found["n"]) <= bounds[1]


def test_the_same_question_has_the_same_answer() -> None:
    texts = ("norm(p) <= 1 m", "distance(p, q) <= 2 m", "norm(q) >= 2.999 m")
    assert search(question(*texts)) == search(question(*texts))


def test_members_of_enums_are_left_to_the_solver() -> None:
    assert search(question("mode == idle")) == (None, {})


def test_long_conditions_are_left_to_the_solver() -> None:
    (condition,) = question("x >= 0 m").terms
    assert search(asked(*[condition] * MAX_PARTS)) == (None, {})


_POINT = {"x": 3.0, "y": -2.0, "a": 1.0, "b": 0.0, "n": 0.5}


@pytest.mark.parametrize(
    ("text", "wanted", "cost"),
    [
        ("x <= 3.5 m", True, 0.0),
        ("x <= 3 m", True, 0.25),  # the slack is missing
        ("x <= 2 m", True, 2.25),
        ("x <= 2.5 m", False, 0.0),
        ("x <= 3 m", False, 0.25),
        ("x >= 5 m", True, 6.25),
        ("x == 3 m", True, 0.0),
        ("x == 1 m", True, 4.0),
        ("x == 3 m", False, 0.25),
        ("x == 1 m", False, 0.0),
        ("a", True, 0.0),
        ("a", False, 0.5),
        ("b", True, 0.5),
        ("not b", True, 0.0),
        ("true", True, 0.0),
        ("false", False, 0.0),
        ("false", True, math.inf),
        ("true", False, math.inf),
        ("x <= 2 m and y >= 0 m", True, 2.25 + 6.25),
        ("x <= 2 m or y >= 0 m", True, 2.25),
        ("x >= 1 m and y <= 0 m", False, 6.25),  # the lesser of both
        ("x >= 1 m or y <= 0 m", False, 6.25 + 6.25),
        ("a == b", True, 0.5),
        ("a == b", False, 0.0),
        ("b == (x >= 1 m)", True, 0.5),
        ("a == (x >= 1 m)", True, 0.0),
        ("if a then x <= 2 m else x >= 9 m", True, 2.25),
        ("if b then x >= 9 m else x <= 2 m", True, 2.25),
        ("(if a then x else y) <= 2 m", True, 2.25),
        ("abs(y) <= 1 m", True, 2.25),
        ("abs(x) <= 2 m", True, 2.25),
        ("min(x, y) >= 0 m", True, 6.25),
        ("max(x, y) <= 0 m", True, 12.25),
        ("x * y >= 0 m*m", True, 42.25),
        ("x + y >= 4 m", True, 12.25),
    ],
)
def test_a_condition_costs_the_squares_of_its_residuals(text: str, wanted: bool, cost: float) -> None:
    """At a point, with a slack of 0.5: squares of what comparisons are off by, and the slack for a truth."""
    condition = lower(check(parse(text), Scope(VARIABLES), BOOL))
    repair = violation_search._repair(condition, wanted, _POINT, 0.5)
    assert repair.cost == pytest.approx(cost)
    assert repair.cost == pytest.approx(
        math.inf
        if cost == math.inf
        else sum(one.value**2 for one in repair.residuals) + 0.5 * len(repair.truths)
    )
    for name, value in repair.truths:
        assert value == 1.0 - _POINT[name]


@pytest.mark.parametrize(
    "text",
    [
        "x * y + 2 m * x",
        "x * x * y",
        "abs(y) * x",
        "min(x, y) * 3",
        "max(x, 2 * y) - y",
        "(if a then x else y) * y",
        "2 * (x + y) * (x - y)",
    ],
)
def test_slopes_are_those_of_small_differences(text: str) -> None:
    unit = {1: "m", 2: "m*m", 3: "m*m*m"}
    for power in unit:
        try:
            condition = lower(check(parse(f"{text} <= 0 {unit[power]}"), Scope(VARIABLES), BOOL))
        except ExpressionTypeError:
            continue
        assert isinstance(condition, t.Compare)
        number = violation_search._number(condition.left, _POINT)
        for name in "xy":
            moved = violation_search._number(condition.left, _POINT | {name: _POINT[name] + 1e-6})
            assert number.slopes.get(name, 0.0) == pytest.approx(
                (moved.value - number.value) / 1e-6, abs=1e-4
            )
        return
    pytest.fail(f"no unit fits {text}")


def test_a_step_makes_all_residuals_zero_if_they_are_linear() -> None:
    rows = [
        violation_search._Number(2.0, {"x": 1.0, "y": 2.0}),
        violation_search._Number(-1.0, {"x": 3.0, "z": 1.0}),
        violation_search._Number(0.5, {"y": 1.0, "z": -1.0}),
    ]
    step = violation_search._step(violation_search._Repair(tuple(rows)), 1e-12)
    for row in rows:
        assert row.value + sum(slope * step[name] for name, slope in row.slopes.items()) == pytest.approx(
            0.0, abs=1e-6
        )


def test_equations_that_follow_from_others_do_no_harm() -> None:
    row = violation_search._Number(2.0, {"x": 1.0, "y": 2.0})
    step = violation_search._step(violation_search._Repair((row, row)), 1e-9)
    assert step == pytest.approx({"x": -0.4, "y": -0.8}, rel=1e-6)
    # The shortest step: along the slopes.
    assert violation_search._step(violation_search._Repair((row._replace(slopes={"x": 0.0}),)), 1e-9) == {}
