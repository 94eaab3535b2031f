"""Demands of typing rules on operands."""

from __future__ import annotations

import pytest

from aeros.spec.expr.parser import parse
from aeros.spec.expr.scope import ExpressionTypeError
from aeros.spec.expr.typecheck.traversal import TypeChecker
from aeros.spec.expr.typecheck.typed_term import (
    TypedTerm,
    require_condition,
    require_rational,
    require_real,
    require_same_type,
    require_vector,
)
from aeros.spec.expr.types import RealType, VectorType
from aeros.spec.expr.units import LENGTH
from tests.unit.spec.expr.scope import SCOPE


def typed(text: str) -> TypedTerm:
    return TypeChecker(SCOPE).check(parse(text))


def test_an_operand_of_the_required_type_passes() -> None:
    assert require_condition(typed("a")) == SCOPE.variables["a"]
    assert require_real(typed("x"), "a factor") == (SCOPE.variables["x"], RealType(LENGTH))
    assert require_vector(typed("p"), "a point") == (SCOPE.variables["p"], VectorType(LENGTH))
    require_same_type(typed("x"), typed("y"), "compared with")


def test_a_bare_norm_is_real_but_no_term() -> None:
    norm = typed("norm(p)")
    assert norm.type == RealType(LENGTH)
    for require in (require_rational, lambda one: require_real(one, "a factor")):
        with pytest.raises(ExpressionTypeError, match="can only be compared"):
            require(norm)


@pytest.mark.parametrize(("right", "code"), [("speed", "AE204"), ("a", "AE203"), ("p", "AE203")])
def test_types_that_differ_in_units_alone_are_a_unit_fault(right: str, code: str) -> None:
    with pytest.raises(ExpressionTypeError) as raised:
        require_same_type(typed("x"), typed(right), "compared with")
    assert raised.value.code == code
    assert (raised.value.cure is not None) == (code == "AE204")
