"""Questions that bounds alone decide, part by part."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from fractions import Fraction

import pytest

from aeros.spec.backends import interval_solver
from aeros.spec.backends.interval_solver import IntervalSolver
from aeros.spec.backends.solver_results import SatResult, ScalarValue, SolverAnswer
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import is_true
from aeros.spec.expr.types import BOOL, EnumType, FamilyType, RealType
from aeros.spec.expr.units import NUMBER

REAL, JOINT = RealType(NUMBER), EnumType("Joint", ("j1", "j2"))
X, Y, Z = (t.Variable(name, REAL, t.VariableRole.STATE) for name in "xyz")
A, B, C = (t.Variable(name, BOOL, t.VariableRole.STATE) for name in "abc")
J = t.Variable("j", FamilyType(JOINT, REAL), t.VariableRole.STATE)
UNIT = (Fraction(0), Fraction(1))
RANGES = dict.fromkeys("xyz", UNIT)
UNSAT = SolverAnswer(SatResult.UNSAT, {})


def number(value: int | str) -> t.Literal:
    return t.Literal(Fraction(value), REAL)


def below(left: t.Term, right: t.Term) -> t.Term:
    return t.Compare("<", left, right)


HARD = t.Compare("==", t.Multiply(X, X), number("1/2"))  # no rational x, so no model is ever found


def decided(*terms: t.Term, ranges: Mapping[str, tuple[Fraction, Fraction]] = RANGES) -> SolverAnswer | None:
    return IntervalSolver().decide([X, Y, Z, A, B, C], ranges, terms)


def model(answer: SolverAnswer | None) -> Mapping[str, ScalarValue]:
    assert answer is not None
    assert answer.result is SatResult.SAT
    return answer.model


def test_a_model_has_a_value_for_every_scalar_also_of_no_condition() -> None:
    found = IntervalSolver().decide(
        [X, A, J], {"x": UNIT, "j[j1]": UNIT, "j[j2]": UNIT}, [below(X, number("1/2"))]
    )
    assert model(found) == {
        "x": Fraction(1, 4), "a": False, "j[j1]": Fraction(1, 2), "j[j2]": Fraction(1, 2)
    }  # fmt: skip


def test_conditions_that_exclude_each_other_have_no_model_wherever_they_stand() -> None:
    assert decided(below(X, Y), A, below(Y, X)) == UNSAT
    assert decided(t.And((below(X, Y), A)), t.Not(t.Or((B, below(X, Y))))) == UNSAT
    assert model(decided(below(X, Y), below(Y, Z)))


@pytest.mark.parametrize("signs", [*itertools.product((True, False), repeat=2)])
def test_every_boolean_form_is_read_as_it_means(signs: tuple[bool, bool]) -> None:
    forms: tuple[t.Term, ...] = (
        t.And((A, B)),
        t.Or((A, B)),
        t.Implies(A, B),
        t.Not(t.Implies(B, t.And((A, t.Not(C))))),
        t.Not(t.Not(t.Or((t.Not(A), C)))),
        t.Conditional(A, B, C),
    )
    for one, other in itertools.product(forms, repeat=2):
        terms = [term if sign else t.Not(term) for term, sign in zip((one, other), signs, strict=True)]
        points = [
            dict(zip("abc", values, strict=True)) for values in itertools.product((True, False), repeat=3)
        ]
        possible = any(all(is_true(term, point) for term in terms) for point in points)
        found = decided(*terms)
        if found is not None:
            assert found.result is (SatResult.SAT if possible else SatResult.UNSAT)
            assert not possible or all(is_true(term, found.model) for term in terms)
        else:
            assert t.Conditional(A, B, C) in (one, other)


def test_a_part_without_a_model_decides_though_another_is_open() -> None:
    assert decided(HARD) is None
    assert decided(HARD, A) is None
    assert decided(HARD, A, t.Not(A)) == UNSAT


def test_parts_that_share_a_variable_through_a_third_are_decided_together() -> None:
    near = below(number("3/4"), X), below(Z, number("1/4"))
    assert decided(*near, below(X, Y), below(Y, Z)) == UNSAT
    assert model(decided(*near, below(Z, Y), below(Y, X)))


def test_an_answer_is_remembered_for_its_ranges_alone() -> None:
    solver = IntervalSolver()
    term = below(number(2), X)
    assert solver.decide([X], {"x": UNIT}, [term]) == UNSAT
    wide = (Fraction(0), Fraction(4))
    assert model(solver.decide([X], {"x": wide}, [term])) == {"x": 3}
    assert model(solver.decide([X], {}, [term])) == {"x": 3}
    assert solver.decide([X], {"x": (Fraction(0), Fraction(1))}, [term]) == UNSAT


def test_an_answer_is_remembered_for_its_conditions_alone() -> None:
    solver = IntervalSolver()
    half = number("1/2")
    asked = [below(X, half), below(half, X), below(Y, half)]
    for _ in range(2):
        for one, other in itertools.combinations(asked, 2):
            found = solver.decide([X, Y], RANGES, [one, other])
            assert found is not None
            assert (found.result is SatResult.UNSAT) is (one is asked[0] and other is asked[1])


def test_a_full_cache_is_emptied_and_answers_stay_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(interval_solver, "MAX_CACHED", 1)
    solver = IntervalSolver()
    for _ in range(3):
        for value in ("1/4", "1/2", "3/4"):
            assert solver.decide([X], RANGES, [below(X, number(value)), below(number(value), X)]) == UNSAT
            assert len(solver._decided) <= 2
