"""Formulas hold exactly where the terms do that they were made of."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from fractions import Fraction
from typing import Any, Literal

import pytest

from aeros.spec.backends.interval.box import intersect, is_empty
from aeros.spec.backends.interval.formula import (
    Conjunction,
    Disjunction,
    Formula,
    OpaqueLiteral,
    ValueConstraint,
    conjuncts_of,
    names_of,
    to_formula,
)
from aeros.spec.backends.interval.interval import Interval
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import is_true
from aeros.spec.expr.types import BOOL, EnumType, RealType
from aeros.spec.expr.units import NUMBER

REAL, MODE = RealType(NUMBER), EnumType("Mode", ("idle", "move", "stop"))
X, Y = (t.Variable(name, REAL, t.VariableRole.STATE) for name in "xy")
A, B = (t.Variable(name, BOOL, t.VariableRole.STATE) for name in "ab")
M = t.Variable("m", MODE, t.VariableRole.STATE)
OPS: tuple[Literal["<", "<=", "=="], ...] = ("<", "<=", "==")


def number(value: int | str) -> t.Literal:
    return t.Literal(Fraction(value), REAL)


def times(factor: int, term: t.Term) -> t.Term:
    return t.Multiply(number(factor), term)


SIDES: tuple[tuple[t.Term, t.Term], ...] = (
    (X, number(1)),
    (number(1), X),
    (X, Y),
    (times(-2, X), number(3)),
    (t.Multiply(X, number(-2)), t.Add(Y, number(1))),
    (t.Add(times(2, X), number(1)), t.Add(X, t.Add(X, Y))),
    (t.Add(X, number(1)), t.Add(number(1), X)),
    (t.Add(X, number(1)), X),
    (t.Absolute(X), number(1)),
    (number(1), t.Absolute(X)),
    (t.Absolute(t.Add(X, times(-1, Y))), number(1)),
    (times(2, t.Add(X, number("1/2"))), number(0)),
)
TERMS: tuple[t.Term, ...] = (
    *(
        t.Compare(op, *sides)
        for op, sides in itertools.product(OPS, SIDES)
        if op != "==" or not any(isinstance(side, t.Absolute) for side in sides)
    ),
    t.Compare("==", M, t.Literal("move", MODE)),
    t.Compare("==", t.Literal("move", MODE), M),
    t.Not(A),
    t.And((A, t.Not(B))),
    t.Or((A, t.Compare("<", X, Y))),
    t.And(()),
    t.Or(()),
    t.TRUE,
    t.FALSE,
)
POINTS: list[dict[str, Any]] = [
    {"x": Fraction(x, 2), "y": Fraction(y, 2), "a": a, "b": b, "m": m}
    for x, y in itertools.product(range(-4, 5), range(-3, 4, 2))
    for a, b, m in itertools.product((True, False), (True, False), MODE.members)
]
NUMBERS = [point for point in POINTS if point["a"] and point["b"] and point["m"] == "move"]


def holds(formula: Formula, at: Mapping[str, Any]) -> bool:
    """Evaluate a formula, none of whose parts may be opaque."""
    match formula:
        case Conjunction(parts=parts):
            return all(holds(part, at) for part in parts)
        case Disjunction(parts=parts):
            return any(holds(part, at) for part in parts)
        case ValueConstraint(subject=of, values=Interval() as values):
            value = at[of] if isinstance(of, str) else sum(factor * at[name] for name, factor in of)
            return not is_empty(intersect(values, Interval(value, value)))
        case ValueConstraint(subject=str() as of, values=values):
            return at[of] in values
    raise AssertionError(formula)


@pytest.mark.parametrize("term", TERMS, ids=map(str, range(len(TERMS))))
def test_a_formula_holds_where_its_term_does_and_its_negation_elsewhere(term: t.Term) -> None:
    plain, negated = (to_formula(term, is_true=is_true) for is_true in (True, False))
    for point in (
        NUMBERS if isinstance(term, t.Compare) and t.variables_of(term).keys() <= {*"xy"} else POINTS
    ):
        assert (holds(plain, point), holds(negated, point)) == (
            is_true(term, point),
            not is_true(term, point),
        )


@pytest.mark.parametrize(
    "term",
    [
        t.Compare("<", t.Multiply(X, Y), number(1)),
        t.Compare("<", number(1), t.Add(X, t.Extremum("min", X, Y))),
        t.Compare("<", t.Multiply(t.Absolute(X), number(2)), number(1)),
        t.Compare("==", t.Absolute(X), number(1)),
        t.Compare("==", number(1), t.Absolute(X)),
        t.Compare("==", A, B),
        t.Compare("==", M, M),
        t.Conditional(A, B, A),
    ],
)
def test_a_condition_of_another_kind_stays_a_term(term: t.Term) -> None:
    assert to_formula(term, is_true=True) == OpaqueLiteral(term, True)
    assert to_formula(t.Not(term), is_true=True) == OpaqueLiteral(term, False)


def test_a_sum_is_written_with_the_first_factor_one_so_that_equal_ones_are_equal() -> None:
    one = t.Compare("<=", t.Add(times(2, X), times(4, Y)), number(6))
    other = t.Compare("<=", number(-3), t.Add(times(-1, X), times(-2, Y)))
    expected = ValueConstraint((("x", Fraction(1)), ("y", Fraction(2))), Interval(high=Fraction(3)))
    assert to_formula(one, is_true=True) == to_formula(other, is_true=True) == expected


def test_a_formula_is_split_at_its_conjunctions_alone() -> None:
    one, two, three = (ValueConstraint(name, frozenset({True})) for name in "abc")
    either = Disjunction((Conjunction((one, two)), three))
    nested = Conjunction((one, Conjunction((two, Conjunction(()))), either))
    assert conjuncts_of(nested) == [one, two, either]
    assert conjuncts_of(one) == [one]


def test_the_names_of_a_formula_are_those_of_all_its_variables() -> None:
    formula = Conjunction(
        (
            to_formula(t.Compare("<", X, Y), is_true=True),
            Disjunction((to_formula(A, is_true=False), OpaqueLiteral(t.Compare("==", M, M), True))),
        )
    )
    assert names_of(formula) == {"x", "y", "a", "m"}
    assert names_of(Disjunction(())) == frozenset()
