"""Questions that Z3 answers together: what they have in common, and what is left to be asked alone."""

from __future__ import annotations

import itertools
from fractions import Fraction

import pytest
import z3

from aeros.spec.backends import z3_group as module
from aeros.spec.backends.solver_results import Question, SatResult, SolverAnswer
from aeros.spec.backends.z3_group import answer_together
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL, EnumType, IntegerType, RealType, VectorType
from aeros.spec.expr.units import NUMBER

REAL = RealType(NUMBER)
X, Y = (t.Variable(name, REAL, t.VariableRole.STATE) for name in "xy")
B = t.Variable("b", BOOL, t.VariableRole.STATE)
SIDES = EnumType("side", ("left", "right"))
SIDE = t.Variable("side", SIDES, t.VariableRole.STATE)
TEN = {"x": (Fraction(0), Fraction(10)), "y": (Fraction(0), Fraction(10))}
BUDGET = (1_000_000, 10.0)


def number(value: int) -> t.Literal:
    return t.Literal(Fraction(value), REAL)


def above(variable: t.Variable, bound: int) -> t.Compare:
    return t.Compare("<", number(bound), variable)


def results(*questions: Question) -> list[str | None]:
    return [None if one is None else one.result.value for one in answer_together(questions, *BUDGET)]


def test_each_question_has_an_answer_and_a_model_of_its_own_variables() -> None:
    left = t.Compare("==", SIDE, t.Literal("left", SIDES))
    found = answer_together(
        [
            Question([X], TEN, [above(X, 9)]),
            Question([X, Y], TEN, [t.Not(above(X, 1)), above(Y, 9)]),
            Question([B, SIDE], {}, [B, t.Not(left)]),
            Question([B], {}, [B, t.Not(B)]),
            Question([X], TEN, [above(X, 10)]),
        ],
        *BUDGET,
    )
    assert [one is not None and one.result for one in found] == [SatResult.SAT] * 3 + [SatResult.UNSAT] * 2
    first, second, third, *_ = (one.model for one in found if one is not None)
    assert first.keys() == {"x"}
    assert second.keys() == {"x", "y"}
    assert third == {"b": True, "side": "right"}


def test_contradictions_between_questions_do_not_matter() -> None:
    assert results(Question([B], {}, [B]), Question([B], {}, [t.Not(B)])) == ["sat", "sat"]


@pytest.mark.parametrize(
    ("other", "ranges"),
    [
        (X, {"x": (Fraction(20), Fraction(30))}),
        (X, {}),
        (t.Variable("x", IntegerType(), t.VariableRole.STATE), TEN),
        (t.Variable("x", VectorType(NUMBER), t.VariableRole.STATE), {}),
    ],
)
def test_one_name_with_two_types_or_ranges_is_two_variables(
    other: t.Variable, ranges: dict[str, tuple[Fraction, Fraction]]
) -> None:
    between = (above(X, 2), t.Compare("<", X, number(3)))
    condition = between if other.type == REAL and ranges == {} else (t.TRUE,)
    found = results(Question([X], TEN, between), Question([other], ranges, condition))
    assert found == ["sat", "sat"]


def test_a_range_without_values_proves_nothing_about_other_questions() -> None:
    empty = {"y": (Fraction(1), Fraction(0))}
    assert results(Question([X], TEN, [above(X, 3)]), Question([Y], empty, [t.TRUE])) == [None, None]


def test_a_spent_budget_leaves_the_rest_to_be_asked_alone() -> None:
    product = t.Compare("==", t.Multiply(X, t.Multiply(Y, Y)), number(998))
    questions = [Question([X, Y], TEN, [product]), Question([X], TEN, [above(X, 10)])]
    assert answer_together(questions, 1, 10.0) == [None, None]


def test_an_error_of_the_solver_leaves_the_rest_to_be_asked_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    class Broken(z3.Solver):  # type: ignore[misc]
        asked = 0

        def check(self) -> object:
            Broken.asked += 1
            if Broken.asked > 1:
                raise z3.Z3Exception("out of memory")
            return super().check()

    monkeypatch.setattr(z3, "Solver", Broken)
    assert results(Question([X], TEN, [above(X, 3)]), Question([X], TEN, [above(X, 4)])) == [None, None]


def test_one_model_settles_many_questions(monkeypatch: pytest.MonkeyPatch) -> None:
    checks = itertools.count()
    check = module._Group._check

    def counted(group: object) -> object:
        next(checks)
        return check(group)  # type: ignore[arg-type]

    monkeypatch.setattr(module._Group, "_check", counted)
    questions = [Question([X], TEN, [above(X, bound)]) for bound in range(9)]
    assert results(*questions) == ["sat"] * 9
    assert next(checks) == 1


def test_a_group_has_the_budget_and_the_time_limit_of_a_step(monkeypatch: pytest.MonkeyPatch) -> None:
    given: dict[str, object] = {}
    monkeypatch.setattr(z3.Solver, "set", lambda solver, name, value: given.update({name: value}))
    answer_together([Question([X], TEN, [above(X, 3)])], 12_345, 2.5)
    assert given == {"random_seed": 0, "rlimit": 12_345, "timeout": 2500, "phase_selection": 1}


def test_no_question_has_no_answer() -> None:
    assert answer_together([], *BUDGET) == []


def test_a_model_may_be_irrational_and_is_then_near() -> None:
    root = t.Compare("==", t.Multiply(X, X), number(2))
    (found,) = answer_together([Question([X], TEN, [root])], *BUDGET)
    assert isinstance(found, SolverAnswer)
    value = found.model["x"]
    assert isinstance(value, Fraction)
    assert abs(value * value - 2) < Fraction(1, 10**20)


def test_each_question_keeps_its_ranges_beside_those_of_others() -> None:
    x, y = ({name: TEN[name]} for name in "xy")
    questions = [
        Question([X], x, [above(X, 10)]),
        Question([Y], y, [above(Y, 10)]),
        Question([X], x, [t.Not(above(X, -1))]),
        Question([Y], y, [above(Y, 9)]),
        Question([B], {}, [B]),
    ]
    assert results(*questions) == ["unsat", "unsat", "unsat", "sat", "sat"]


def test_a_range_is_noted_of_each_question_that_joins_others() -> None:
    """The first two have no variable in common, and the third has another range than the second."""
    low, high = ({"y": (Fraction(start), Fraction(start + 1))} for start in (0, 5))
    questions = [
        Question([X], TEN, [above(X, 3)]),
        Question([Y], low, [above(Y, 2)]),
        Question([Y], high, [above(Y, 2)]),
        Question([X, Y], TEN | low, [above(X, 3), above(Y, 2)]),
    ]
    assert results(*questions) == ["sat", "unsat", "sat", "unsat"]
