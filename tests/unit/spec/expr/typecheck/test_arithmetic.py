"""Sums, products and quotients: dimensions of the results, and literals that are folded."""

from __future__ import annotations

from fractions import Fraction

import pytest

from aeros.spec.expr import terms as t
from aeros.spec.expr.parser import parse
from aeros.spec.expr.typecheck.traversal import TypeChecker
from aeros.spec.expr.types import RealType, Type, VectorType
from aeros.spec.expr.units import LENGTH, NUMBER, TIME
from tests.unit.spec.expr.scope import SCOPE, SPEED


@pytest.mark.parametrize(
    ("text", "type_"),
    [
        ("x + y", RealType(LENGTH)),
        ("p - q", VectorType(LENGTH)),
        ("x * y", RealType(LENGTH**2)),
        ("x * p", VectorType(LENGTH**2)),
        ("p * x", VectorType(LENGTH**2)),
        ("speed / 2 m", RealType(TIME**-1)),
        ("-p", VectorType(LENGTH)),
        ("-speed", SPEED),
    ],
)
def test_dimensions_are_kept_by_sums_and_multiplied_by_products(text: str, type_: Type) -> None:
    assert TypeChecker(SCOPE).check(parse(text)).type == type_


@pytest.mark.parametrize(
    ("text", "value"), [("2 * 3", 6), ("-4", -4), ("3 / 4", Fraction(3, 4)), ("-(2 / 3)", Fraction(-2, 3))]
)
def test_products_of_literals_are_literals(text: str, value: Fraction) -> None:
    typed = TypeChecker(SCOPE).check(parse(text))
    assert typed.term == t.Literal(Fraction(value), RealType(NUMBER))
    assert (typed.extent.start, typed.extent.end) == (0, len(text))
