from __future__ import annotations

from fractions import Fraction
from typing import Any

import pytest

from aeros.runtime.execution.inputs import InputError, check_inputs
from aeros.spec.diagnostics.source import Source
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL, EnumType, FamilyType, IntegerType, RealType, Type, VectorType
from aeros.spec.expr.units import LENGTH, NUMBER
from aeros.spec.model.variables import Declared

SPAN = Source("ecm.yaml", "text").span(0, 4)
PAIR = EnumType("pair", ("a", "b"))
TENTH = Fraction(1, 10)


def declared(
    type_: Type, bounds: tuple[Fraction, Fraction] | None, default: Any = None
) -> dict[str, Declared]:
    return {
        "x": Declared(
            t.Variable("inputs.x", type_, t.VariableRole.INPUT), SPAN, range=bounds, default_value=default
        )
    }


REAL = declared(RealType(LENGTH), (-TENTH, TENTH))
POINT = declared(VectorType(LENGTH), (-TENTH, TENTH), (TENTH, Fraction(0), -TENTH))
FLAGS = declared(FamilyType(PAIR, BOOL), None)
COUNT = declared(IntegerType(NUMBER), (Fraction(0), Fraction(5)))
LENGTHS = declared(FamilyType(PAIR, RealType(LENGTH)), (Fraction(0), Fraction(1)))


@pytest.mark.parametrize(
    ("inputs", "given", "settled"),
    [
        (REAL, 0, 0.0),
        (REAL, 0.05, 0.05),
        (REAL, TENTH, 0.09999999999999999),
        (REAL, -TENTH, -0.09999999999999999),
        (POINT, (0, 0.05, Fraction(1, 100)), (0.0, 0.05, 0.01)),
        (POINT, [0, 0, 0], (0.0, 0.0, 0.0)),
        (FLAGS, (True, False), (True, False)),
        (LENGTHS, (1, 0.5), (1.0, 0.5)),
        (COUNT, 3, 3),
        (COUNT, 5.0, 5),
        (COUNT, Fraction(0), 0),
        (declared(RealType(LENGTH), None), Fraction(1, 3), 1 / 3),
    ],
)
def test_a_value_of_the_declared_type_is_settled(
    inputs: dict[str, Declared], given: Any, settled: Any
) -> None:
    found = check_inputs(inputs, {"x": given})["x"]
    assert (found, repr(found)) == (settled, repr(settled))


def test_an_exact_default_is_settled_inside_its_range() -> None:
    assert check_inputs(POINT, {})["x"] == (0.09999999999999999, 0.0, -0.09999999999999999)


class _Float(float):
    pass


@pytest.mark.parametrize(
    ("inputs", "given", "why"),
    [
        # The double 0.1 is more than 1/10.
        (REAL, 0.1, r"`x` = 0\.10000000000000001 is outside its range"),
        (REAL, 10**400, "`x` is outside its range"),
        (REAL, _Float(0.0), "the input `x` is not a finite number"),
        (REAL, float("inf"), "the input `x` is not a finite number"),
        (REAL, (0.0,), "the input `x` is not a finite number"),
        (POINT, {0.0: 0.0}, "the input `x` is not a list of 3 values"),
        (POINT, (0.0, 0.0), "the input `x` is not a list of 3 values"),
        (POINT, (0.0, 0.0, 1.0), "the input `x` = 1 is outside its range"),
        (POINT, (0.0, 0.0, True), "the input `x` is not a finite number"),
        (FLAGS, (True, 0), "the input `x` is not a truth value"),
        (FLAGS, True, "the input `x` is not a list of 2 values"),
        (LENGTHS, (0.0, 2.0), "the input `x` = 2 is outside its range"),
        (COUNT, 2.5, "the input `x` is not a whole number"),
        (COUNT, 6, "`x` = 6 is outside its range"),
        (declared(RealType(LENGTH), None), 10**400, "the input `x` is too large"),
    ],
)
def test_anything_else_is_an_error(inputs: dict[str, Declared], given: Any, why: str) -> None:
    with pytest.raises(InputError, match=why):
        check_inputs(inputs, {"x": given})


def test_an_input_without_value_or_default_is_missing() -> None:
    with pytest.raises(InputError, match="the input `x` is missing"):
        check_inputs(REAL, {})
