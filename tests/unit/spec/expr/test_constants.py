"""Values of effects, inputs and witnesses as constant terms."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import pytest

from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.expr import terms as t
from aeros.spec.expr.constants import constant_term
from aeros.spec.expr.types import BOOL, EnumType, FamilyType, RealType, Type, VectorType
from aeros.spec.expr.units import LENGTH, NUMBER

MODE = EnumType("mode", ("idle", "busy"))
METRES = RealType(LENGTH)


def test_a_value_is_a_literal_or_a_vector_of_literals() -> None:
    assert constant_term(True, BOOL) == t.TRUE
    assert constant_term("idle", MODE) == t.Literal("idle", MODE)
    assert constant_term(Fraction(1, 2), METRES) == t.Literal(Fraction(1, 2), METRES)
    assert constant_term((1, 0, Fraction(-1, 2)), VectorType(LENGTH)) == t.Vector(
        t.Literal(Fraction(1), METRES), t.Literal(Fraction(0), METRES), t.Literal(Fraction(-1, 2), METRES)
    )


@pytest.mark.parametrize(
    ("value", "type_"),
    [((Fraction(0),) * 3, RealType(NUMBER)), (Fraction(0), FamilyType(MODE, RealType(NUMBER)))],
)
def test_a_family_and_a_vector_for_a_scalar_are_no_constants(value: Any, type_: Type) -> None:
    with pytest.raises(MisuseError, match="is no constant of the type"):
        constant_term(value, type_)
