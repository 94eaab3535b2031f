"""Questions that are proved, or not."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

from aeros.spec.backends.oracle import Oracle
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL, RealType
from aeros.spec.expr.units import NUMBER
from aeros.spec.model.variables import Declared
from aeros.spec.verification.queries import is_implied, is_unsatisfiable
from tests.unit.agent.dumplings import state

REAL = RealType(NUMBER)
X = state("x", REAL, (Fraction(0), Fraction(4)))
A = state("a", BOOL)


def below(one: Declared, value: str) -> t.Term:
    return t.Compare("<", one.variable, t.Literal(Fraction(value), REAL))


def test_conditions_exclude_each_other_inside_the_declared_range() -> None:
    oracle = Oracle()
    assert is_unsatisfiable([below(X, "0")], [X, A], oracle)
    assert not is_unsatisfiable([below(X, "1/9")], [X, A], oracle)
    assert is_unsatisfiable([A.variable, t.Not(A.variable)], [X, A], oracle)
    assert not is_unsatisfiable([], [X], oracle)
    assert not is_unsatisfiable([below(replace(X, range=None), "0")], [replace(X, range=None)], oracle)


def test_known_facts_of_a_variable_count() -> None:
    known = replace(A, known_facts=(t.Or((t.Not(A.variable), below(X, "1"))),))
    far = t.Not(below(X, "1"))
    assert is_unsatisfiable([A.variable, far], [X, known], Oracle())
    assert not is_unsatisfiable([A.variable, far], [X, A], Oracle())


def test_a_conclusion_follows_from_all_assumptions_together() -> None:
    oracle = Oracle()
    assert is_implied(below(X, "3"), [below(X, "2")], [X], oracle)
    assert not is_implied(below(X, "2"), [below(X, "3")], [X], oracle)
    assert is_implied(below(X, "5"), [], [X], oracle)
    assert is_implied(A.variable, [below(X, "1"), t.Not(below(X, "2"))], [X, A], oracle)


def test_nothing_is_proved_where_the_budget_runs_out() -> None:
    cube = t.Multiply(X.variable, t.Multiply(X.variable, X.variable))
    hard = t.Compare("==", t.Add(cube, X.variable), t.Literal(Fraction(-1), REAL))
    assert is_unsatisfiable([hard], [X], Oracle())
    square = t.Multiply(X.variable, X.variable)
    harder = [t.Compare("==", t.Add(cube, square), t.Literal(Fraction(7), REAL)), below(X, "1")]
    assert not is_unsatisfiable([t.Not(t.And(tuple(harder)))], [X], Oracle(1))
