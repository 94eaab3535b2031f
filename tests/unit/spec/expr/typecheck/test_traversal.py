"""Traversal: enums of bare members, the order of checks, and the parts that are remembered."""

from __future__ import annotations

import pytest

from aeros.spec.expr import terms as t
from aeros.spec.expr.parser import parse
from aeros.spec.expr.scope import ExpressionTypeError
from aeros.spec.expr.syntax import ComparisonChain
from aeros.spec.expr.typecheck.traversal import TypeChecker
from tests.unit.spec.expr.scope import GRIP, SCOPE


@pytest.mark.parametrize(
    "text", ["grip == stop", "stop == grip", "stop == inputs.grip", "stop == stop == grip"]
)
def test_a_neighbour_chooses_the_enum_of_a_member(text: str) -> None:
    checker = TypeChecker(SCOPE)
    node = parse(text)
    assert isinstance(node, ComparisonChain)
    checker.check(node)
    terms = [part.term for part in checker.parts_of(node)]
    members = [
        side
        for term in terms
        if isinstance(term, t.Compare)
        for side in (term.left, term.right)
        if isinstance(side, t.Literal)
    ]
    assert {member.type for member in members} == {GRIP}


def test_the_parts_of_a_chain_are_its_pairs_with_their_places() -> None:
    text = "0 m < x <= y"
    checker, node = TypeChecker(SCOPE), parse(text)
    checker.check(node)
    assert [text[part.extent.start : part.extent.end] for part in checker.parts_of(node)] == [
        "0 m < x",
        "x <= y",
    ]


@pytest.mark.parametrize(
    ("text", "first"),
    [
        ("one / two", "two"),  # only a constant divides, so the divisor is checked first
        ("one * two", "one"),
        ("one in two", "two"),
        ("if one then two else three", "one"),
        ("one < two", "one"),
    ],
)
def test_the_first_fault_in_the_order_of_checks_is_reported(text: str, first: str) -> None:
    with pytest.raises(ExpressionTypeError, match=f"`{first}` is not"):
        TypeChecker(SCOPE).check(parse(text))
