"""The search finds a model, shows that there is none, or leaves the question open."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

import pytest

from aeros.spec.backends.interval import search
from aeros.spec.backends.interval.box import Box
from aeros.spec.backends.interval.formula import (
    Conjunction,
    Disjunction,
    Formula,
    OpaqueLiteral,
    ValueConstraint,
    to_formula,
)
from aeros.spec.backends.interval.interval import Interval
from aeros.spec.backends.interval.search import BranchAndPrune
from aeros.spec.backends.solver_results import SatResult, ScalarValue, SolverAnswer
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL, IntegerType, RealType
from aeros.spec.expr.units import NUMBER

REAL = RealType(NUMBER)
X, Y = (t.Variable(name, REAL, t.VariableRole.STATE) for name in "xy")
A = t.Variable("a", BOOL, t.VariableRole.STATE)
LAPS = t.Variable("laps", IntegerType(), t.VariableRole.STATE)
UNSAT = SolverAnswer(SatResult.UNSAT, {})


def number(value: int | str) -> t.Literal:
    return t.Literal(Fraction(value), REAL)


def between(low: int | str, high: int | str) -> Interval:
    return Interval(Fraction(low), Fraction(high))


def is_in(name: str, low: int | str, high: int | str) -> ValueConstraint:
    return ValueConstraint(name, between(low, high))


def of(term: t.Term) -> Formula:
    return to_formula(term, is_true=True)


def searched(*formulas: Formula, laps: Interval | None = None) -> SolverAnswer | None:
    box: Box = {"x": between(0, 2), "y": between(0, 2), "a": frozenset({False, True})}
    box["laps"] = between(0, 3) if laps is None else laps
    return BranchAndPrune([X, Y, A, LAPS]).run(list(formulas), box)


def model(answer: SolverAnswer | None) -> Mapping[str, ScalarValue]:
    assert answer is not None
    assert answer.result is SatResult.SAT
    return answer.model


SQUARE = t.Multiply(X, X)
SQUARE_IS_TWO = OpaqueLiteral(t.Compare("==", SQUARE, number(2)), True)  # no rational x
NEVER = Conjunction((is_in("x", 0, "1/2"), is_in("x", 1, 2)))


def test_without_conditions_the_middle_of_the_box_is_a_model() -> None:
    assert model(searched()) == {"x": 1, "y": 1, "a": False, "laps": 1}


def test_a_condition_narrows_the_model_and_two_that_exclude_each_other_have_none() -> None:
    assert model(searched(is_in("x", 0, "1/2")))["x"] == Fraction(1, 4)
    assert searched(is_in("x", 0, "1/2"), is_in("x", 1, 2)) == UNSAT


def test_the_values_of_a_model_have_the_sum_that_is_asked_for() -> None:
    found = model(searched(of(t.Compare("==", t.Add(X, Y), number("7/2")))))
    assert (found["x"], found["y"]) == (Fraction(7, 4), Fraction(7, 4))


def test_a_middle_that_is_no_model_is_followed_by_the_corners() -> None:
    above = OpaqueLiteral(t.Compare("<=", number(3), SQUARE), True)
    assert model(searched(above))["x"] == 2
    below = OpaqueLiteral(t.Compare("<=", number("1/2"), SQUARE), False)
    assert model(searched(below))["x"] == 0


def test_only_variables_of_the_conditions_go_to_a_corner() -> None:
    either = OpaqueLiteral(t.Compare("==", t.Extremum("max", X, Y), t.Multiply(X, t.Multiply(Y, Y))), True)
    found = model(searched(either, OpaqueLiteral(t.Compare("==", SQUARE, number(1)), False)))
    assert found == {"x": 0, "y": 0, "a": False, "laps": 1}


def test_a_condition_that_no_point_tried_meets_is_left_open() -> None:
    assert searched(SQUARE_IS_TWO) is None


def test_alternatives_are_tried_one_after_another() -> None:
    choice = Disjunction((NEVER, is_in("y", 0, 1), ValueConstraint("a", frozenset({True}))))
    assert model(searched(choice)) == {"x": 1, "y": Fraction(1, 2), "a": False, "laps": 1}
    assert searched(Disjunction((NEVER, NEVER))) == UNSAT


def test_the_choice_with_the_fewest_alternatives_is_made_first() -> None:
    many = Disjunction(tuple(is_in("x", "1/2", high) for high in ("3/4", 1, "3/2")))
    few = Disjunction((is_in("x", 0, "1/8"), is_in("x", 0, "3/4")))
    assert model(searched(many, few))["x"] == Fraction(5, 8)


def test_an_alternative_that_is_left_open_leaves_the_whole_open_unless_another_is_met() -> None:
    assert searched(Disjunction((SQUARE_IS_TWO, NEVER))) is None
    assert searched(Disjunction((NEVER, SQUARE_IS_TWO))) is None
    assert model(searched(Disjunction((SQUARE_IS_TWO, is_in("y", 0, 1)))))["y"] == Fraction(1, 2)


def test_one_alternative_leaves_no_trace_in_the_next() -> None:
    fails = Conjunction((is_in("y", 2, 2), NEVER))
    assert model(searched(Disjunction((fails, is_in("x", 0, 1)))))["y"] == 1


def test_a_whole_number_is_never_given_a_fraction() -> None:
    assert model(searched(laps=between("1/2", "5/2")))["laps"] == 1
    assert searched(laps=between("1/4", "3/4")) is None


def test_a_question_of_too_many_boxes_is_left_open(monkeypatch: pytest.MonkeyPatch) -> None:
    choice = Disjunction((NEVER, is_in("y", 0, 1), is_in("y", 1, 2)))
    monkeypatch.setattr(search, "MAX_BOXES", 3)
    assert model(searched(choice))["y"] == Fraction(1, 2)
    monkeypatch.setattr(search, "MAX_BOXES", 2)
    assert searched(choice) is None


def test_as_many_corners_are_tried_as_are_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    above = OpaqueLiteral(t.Compare("<=", number(3), SQUARE), True)  # met at the second corner
    monkeypatch.setattr(search, "MAX_CORNERS", 2)
    assert model(searched(above))["x"] == 2
    monkeypatch.setattr(search, "MAX_CORNERS", 1)
    assert searched(above) is None
