"""Function calls: signatures, and types of results."""

from __future__ import annotations

import pytest

from aeros.spec.expr.parser import parse
from aeros.spec.expr.scope import ExpressionTypeError
from aeros.spec.expr.typecheck.desugar import ARITY
from aeros.spec.expr.typecheck.traversal import TypeChecker
from aeros.spec.expr.types import RealType, Type, VectorType
from aeros.spec.expr.units import LENGTH, TIME
from tests.unit.spec.expr.scope import SCOPE


@pytest.mark.parametrize(
    ("text", "type_"),
    [
        ("abs(x)", RealType(LENGTH)),
        ("clamp(x, y, x)", RealType(LENGTH)),
        ("vec(x, y, x)", VectorType(LENGTH)),
        ("norm(v)", RealType(LENGTH * TIME**-1)),
        ("distance(p, q)", RealType(LENGTH)),
        ("dot(p, v)", RealType(LENGTH**2 * TIME**-1)),
    ],
)
def test_a_call_has_the_dimension_of_its_arguments(text: str, type_: Type) -> None:
    assert TypeChecker(SCOPE).check(parse(text)).type == type_


@pytest.mark.parametrize("name", ARITY)
def test_the_number_of_arguments_is_checked_before_the_arguments(name: str) -> None:
    undeclared = ", ".join(["undeclared"] * (ARITY[name] + 1))
    with pytest.raises(ExpressionTypeError, match=rf"`{name}` takes {ARITY[name]} argument"):
        TypeChecker(SCOPE).check(parse(f"{name}({undeclared})"))
