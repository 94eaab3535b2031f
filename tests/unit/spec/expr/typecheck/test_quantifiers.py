"""Quantifiers, sums and counts over the members of an enum."""

from __future__ import annotations

import pytest

from aeros.spec.expr import terms as t
from aeros.spec.expr.parser import parse
from aeros.spec.expr.typecheck.traversal import TypeChecker
from aeros.spec.expr.types import BOOL, RealType, Type
from aeros.spec.expr.units import LENGTH, NUMBER
from tests.unit.spec.expr.scope import SCOPE


@pytest.mark.parametrize(
    ("text", "node", "type_"),
    [
        ("all(ready[j] for j in Joint)", t.Quantified, BOOL),
        ("any(ready[j] for j in Joint)", t.Quantified, BOOL),
        ("count(ready[j] for j in Joint)", t.Aggregate, RealType(NUMBER)),
        ("sum(joint[j] for j in Joint)", t.Aggregate, RealType(LENGTH)),
    ],
)
def test_a_body_is_bound_to_its_index(text: str, node: type[t.Quantified | t.Aggregate], type_: Type) -> None:
    typed = TypeChecker(SCOPE).check(parse(text))
    assert isinstance(typed.term, node)
    assert typed.type == type_
    assert typed.term.index == t.BoundVariable("j", SCOPE.enums["Joint"])
    assert isinstance(typed.term.body, t.Select)
    assert typed.term.body.index == typed.term.index
