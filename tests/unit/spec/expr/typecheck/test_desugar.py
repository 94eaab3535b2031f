"""Functions and comparisons with norms have the values of their definitions, over a grid."""

from __future__ import annotations

import itertools
import math
import operator
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import pytest

from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import evaluate, is_true
from aeros.spec.expr.typecheck.desugar import ARITY, Norm, Relation, compare_terms, dot, expand_function
from aeros.spec.expr.types import RealType, VectorType
from aeros.spec.expr.units import LENGTH, NUMBER

REAL = RealType(NUMBER)
X, Y, Z = (t.Variable(name, REAL, t.VariableRole.STATE) for name in "xyz")
P, Q = (t.Variable(name, VectorType(LENGTH), t.VariableRole.STATE) for name in "pq")
GRID = [Fraction(value, 2) for value in range(-4, 5)]
OPS: dict[Relation, Callable[[Any, Any], bool]] = {
    "<": operator.lt,
    "<=": operator.le,
    "==": operator.eq,
}


def test_the_scalar_product_is_the_sum_of_the_products() -> None:
    at = {"p": (Fraction(2), Fraction(-3), Fraction(5)), "q": (Fraction(7), Fraction(11), Fraction(13))}
    assert evaluate(dot(P, Q), at) == 14 - 33 + 65


def test_a_function_of_numbers_has_its_value() -> None:
    def value(name: str, *numbers: int) -> object:
        arguments: list[t.Term] = [*(X, Y, Z)[: len(numbers)]]
        assert len(numbers) == ARITY[name]
        return evaluate(
            expand_function(name, arguments), dict(zip("xyz", map(Fraction, numbers), strict=False))
        )

    assert [value("abs", one) for one in (-3, 0, 3)] == [3, 0, 3]
    assert [value("min", 2, 5), value("max", 2, 5), value("min", 5, 2), value("max", 5, 2)] == [2, 5, 2, 5]
    assert [value("clamp", one, 1, 4) for one in (0, 1, 3, 4, 9)] == [1, 1, 3, 4, 4]
    assert value("vec", 1, 2, 3) == (1, 2, 3)


@pytest.mark.parametrize("op", OPS)
def test_a_norm_is_compared_with_a_number_on_either_side(op: Relation) -> None:
    norm = Norm(t.Multiply(X, X), NUMBER)  # the norm of x is |x|
    left, right = compare_terms(op, norm, Y), compare_terms(op, Y, norm)
    for x, y in itertools.product(GRID, repeat=2):
        at = {"x": x, "y": y}
        assert (is_true(left, at), is_true(right, at)) == (OPS[op](abs(x), y), OPS[op](y, abs(x)))


@pytest.mark.parametrize("op", OPS)
def test_two_norms_are_compared(op: Relation) -> None:
    term = compare_terms(op, Norm(t.Multiply(X, X), NUMBER), Norm(t.Multiply(Y, Y), NUMBER))
    for x, y in itertools.product(GRID, repeat=2):
        assert is_true(term, {"x": x, "y": y}) is OPS[op](abs(x), abs(y))


@pytest.mark.parametrize("op", OPS)
def test_an_irrational_norm_is_compared_without_its_root(op: Relation) -> None:
    term = compare_terms(op, Norm(dot(P, P), LENGTH * LENGTH), Y)
    at = {"p": (Fraction(1), Fraction(1), Fraction(0))}
    for bound in (Fraction(141421356, 10**8), Fraction(141421357, 10**8)):
        assert is_true(term, {**at, "y": bound}) is OPS[op](math.sqrt(2), float(bound))


def _length(value: int) -> t.Literal:
    return t.Literal(Fraction(value), RealType(LENGTH))


@pytest.mark.parametrize("op", OPS)
@pytest.mark.parametrize("bound", [-6, -5, -1, 0, 4, 5, 6])
@pytest.mark.parametrize("squared", [0, 25])
def test_a_norm_is_compared_by_its_square(op: Relation, bound: int, squared: int) -> None:
    norm = Norm(t.Literal(Fraction(squared), RealType(LENGTH**2)), LENGTH)
    root = math.isqrt(squared)
    assert evaluate(compare_terms(op, norm, _length(bound)), {}) is OPS[op](root, bound)
    assert evaluate(compare_terms(op, _length(bound), norm), {}) is OPS[op](bound, root)
    assert evaluate(compare_terms(op, norm, norm), {}) is OPS[op](root, root)
    zeros = {part.type for part in _literals(compare_terms(op, norm, _length(bound))) if part.value == 0}
    assert squared * bound == 0 or zeros == {RealType(LENGTH)}


def _literals(term: t.Term) -> list[t.Literal]:
    below = [found for child in t.children(term) for found in _literals(child)]
    return [term, *below] if isinstance(term, t.Literal) else below
