"""Past-time operators become three kinds of terms."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest

from aeros.spec.expr import terms as t
from aeros.spec.expr.parser import parse
from aeros.spec.expr.typecheck.traversal import TypeChecker
from aeros.spec.expr.types import BOOL, RealType
from aeros.spec.expr.units import NUMBER
from tests.unit.spec.expr.scope import SCOPE

PAST = replace(SCOPE, past=True)
A, B = SCOPE.variables["a"], SCOPE.variables["b"]


@pytest.mark.parametrize(
    ("text", "term"),
    [
        ("previously a", t.Previously(A)),
        ("once a", t.Since(t.TRUE, A, None)),
        ("once within 2 s a", t.Since(t.TRUE, A, Fraction(2))),
        ("historically a", t.Not(t.Since(t.TRUE, t.Not(A), None))),
        ("a since within 500 ms b", t.Since(A, B, Fraction(1, 2))),
        ("count within 1 s (a)", t.Occurrences(A, Fraction(1))),
    ],
)
def test_each_operator_has_its_term(text: str, term: t.Term) -> None:
    typed = TypeChecker(PAST).check(parse(text))
    assert typed.term == term
    assert typed.type == (RealType(NUMBER) if isinstance(term, t.Occurrences) else BOOL)
    assert (typed.extent.start, typed.extent.end) == (0, len(text))
