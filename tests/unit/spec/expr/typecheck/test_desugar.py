"""Comparisons with norms mean the same without the root."""

from __future__ import annotations

import math
import operator
from fractions import Fraction

import pytest

from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import evaluate
from aeros.spec.expr.typecheck.desugar import Norm, compare_norm
from aeros.spec.expr.types import RealType
from aeros.spec.expr.units import LENGTH

_OPERATORS = {"<": operator.lt, "<=": operator.le, "==": operator.eq, "!=": operator.ne}


def _length(value: int) -> t.Literal:
    return t.Literal(Fraction(value), RealType(LENGTH))


@pytest.mark.parametrize("op", _OPERATORS)
@pytest.mark.parametrize("bound", [-6, -5, -1, 0, 4, 5, 6])
@pytest.mark.parametrize("squared", [0, 25])
def test_a_norm_is_compared_by_its_square(op: str, bound: int, squared: int) -> None:
    norm = Norm(t.Literal(Fraction(squared), RealType(LENGTH**2)), LENGTH)
    root = math.isqrt(squared)
    assert evaluate(compare_norm(op, norm, _length(bound)), {}) is _OPERATORS[op](root, bound)
    assert evaluate(compare_norm(op, _length(bound), norm), {}) is _OPERATORS[op](bound, root)
    assert evaluate(compare_norm(op, norm, norm), {}) is _OPERATORS[op](root, root)
