"""Expressions made by Z3's C interface are those that its Python operators make."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import pytest
import z3

from aeros.spec.backends.z3_expressions import Expressions

CONTEXT = z3.Context()
MAKE = Expressions(CONTEXT)
A, B = (z3.Bool(name, CONTEXT) for name in "ab")
X, Y = (z3.Real(name, CONTEXT) for name in "xy")
S, T = (z3.Int(name, CONTEXT) for name in "st")


@pytest.mark.parametrize(
    ("maker", "arguments", "expected"),
    [
        ("truth", (True,), z3.BoolVal(True, CONTEXT)),
        ("truth", (False,), z3.BoolVal(False, CONTEXT)),
        ("number", (Fraction(-7, 3),), z3.RealVal("-7/3", CONTEXT)),
        ("negation", (A,), z3.Not(A)),
        ("conjunction", ([A, B, A],), z3.And(A, B, A)),
        ("disjunction", ([A, B],), z3.Or(A, B)),
        ("comparison", ("<", X, Y), X < Y),
        ("comparison", ("<=", X, Y), X <= Y),
        ("comparison", ("==", X, Y), X == Y),
        ("comparison", ("==", S, T), S == T),
        ("comparison", ("==", A, B), A == B),
        ("sum", (X, Y), X + Y),
        ("product", (X, Y), X * Y),
        ("opposite", (X,), -X),
        ("choice", (A, X, Y), z3.If(A, X, Y)),
        ("choice", (A, A, B), z3.If(A, A, B)),
    ],
)
def test_an_expression_is_that_of_the_operator(maker: str, arguments: tuple[Any, ...], expected: Any) -> None:
    made = getattr(MAKE, maker)(*arguments)
    assert made.ctx is CONTEXT
    assert made.eq(expected)
    assert type(made) is type(expected) or z3.is_arith(made)


def test_no_parts_are_true_together_and_none_is_true() -> None:
    assert z3.is_true(z3.simplify(MAKE.conjunction([])))
    assert z3.is_false(z3.simplify(MAKE.disjunction([])))


@pytest.mark.parametrize("op", [">", "!=", "=", ""])
def test_no_other_comparison_is_taken_for_one_of_the_language(op: str) -> None:
    with pytest.raises(KeyError):
        MAKE.comparison(op, X, Y)


def test_a_number_is_made_once_for_each_value() -> None:
    assert MAKE.number(Fraction(2, 4)) is MAKE.number(Fraction(1, 2))
    assert MAKE.new_number(Fraction(1, 2)) is not MAKE.number(Fraction(1, 2))


def test_a_constant_is_true_only_where_the_model_says_so() -> None:
    solver = z3.Solver(ctx=CONTEXT)
    solver.add(A, z3.Not(B))
    assert solver.check() == z3.sat
    found = solver.model()
    assert MAKE.is_true_in(found, A)
    assert not MAKE.is_true_in(found, B)
    assert not MAKE.is_true_in(found, z3.Bool("unspoken", CONTEXT))
