"""Components of vectors and elements of families."""

from __future__ import annotations

import pytest

from aeros.spec.expr import terms as t
from aeros.spec.expr.parser import parse
from aeros.spec.expr.scope import ExpressionTypeError
from aeros.spec.expr.typecheck.traversal import TypeChecker
from aeros.spec.expr.types import BOOL, RealType, Type
from aeros.spec.expr.units import LENGTH
from tests.unit.spec.expr.scope import SCOPE


@pytest.mark.parametrize(("name", "axis"), [("x", 0), ("y", 1), ("z", 2)])
def test_a_component_has_the_dimension_of_its_vector(name: str, axis: int) -> None:
    typed = TypeChecker(SCOPE).check(parse(f"p.{name}"))
    assert typed.term == t.Component(SCOPE.variables["p"], axis)
    assert typed.type == RealType(LENGTH)


@pytest.mark.parametrize(
    ("text", "type_"),
    [("joint[arm]", RealType(LENGTH)), ("ready[j1]", BOOL), ("limit[j2]", RealType(LENGTH))],
)
def test_an_element_has_the_type_of_its_family(text: str, type_: Type) -> None:
    typed = TypeChecker(SCOPE).check(parse(text))
    assert isinstance(typed.term, t.Select)
    assert typed.type == type_


def test_a_base_that_is_no_family_is_refused_before_the_index_is_looked_at() -> None:
    with pytest.raises(ExpressionTypeError, match="cannot be indexed"):
        TypeChecker(SCOPE).check(parse("x[undeclared]"))
