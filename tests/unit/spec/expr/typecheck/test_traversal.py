"""Traversal: enums of bare members, the order of checks, and the parts that are remembered."""

from __future__ import annotations

from fractions import Fraction

import pytest

from aeros.spec.expr import terms as t
from aeros.spec.expr.parser import parse
from aeros.spec.expr.scope import ExpressionTypeError, Scope
from aeros.spec.expr.syntax import ComparisonChain
from aeros.spec.expr.typecheck.traversal import TypeChecker
from aeros.spec.expr.typecheck.typed_term import require_condition
from aeros.spec.expr.types import RealType
from aeros.spec.expr.units import TEMPERATURE
from tests.unit.spec.expr.scope import GRIP, SCOPE


@pytest.mark.parametrize(
    "text", ["grip == stop", "stop == grip", "stop == inputs.grip", "stop == stop == grip"]
)
def test_a_neighbour_chooses_the_enum_of_a_member(text: str) -> None:
    checker = TypeChecker(SCOPE)
    node = parse(text)
    assert isinstance(node, ComparisonChain)
    checker.check(node)
    terms = [term for term, _ in checker.parts_of(node)]
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
    assert [text[extent.start : extent.end] for _, extent in checker.parts_of(node)] == [
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


_TEMPERATURES = {
    name: t.Variable(name, RealType(TEMPERATURE), t.VariableRole.STATE) for name in ("warm", "cold")
}


@pytest.mark.parametrize(
    ("text", "kelvin"),
    [
        ("warm <= 60 °C", "333.15"),
        ("-5 degC < warm", "268.15"),
        ("warm == -0.15°C", "273"),
        ("max(warm, 5 °C) < cold", "278.15"),
        ("warm < min(cold, 5 °C)", "278.15"),
        ("clamp(warm, 5 °C, 300 K) < cold", "278.15"),
        ("warm < (if cold < warm then 5 °C else 300 K)", "278.15"),
    ],
)
def test_a_temperature_in_degrees_celsius_is_compared_as_kelvin(text: str, kelvin: str) -> None:
    term = require_condition(TypeChecker(Scope(_TEMPERATURES)).check(parse(text)))
    assert Fraction(kelvin) in {one.value for one in literals_of(term)}


@pytest.mark.parametrize(
    "text",
    [
        "warm - cold < 5 °C",
        "5 °C > warm - cold",
        "warm - 5 °C < 3 K",
        "warm + 5 °C < cold",
        "-warm < -5 °C",
        "2 * 5 °C < warm",
        "abs(5 °C) < warm",
        "abs(warm) < 5 °C",
        "5 °C/s < warm",
        "min(warm - cold, 3 K) < 5 °C",
        "(if warm < cold then warm - cold else 3 K) < 5 °C",
        "cold < warm < warm - 5 °C",
    ],
)
def test_a_temperature_in_degrees_celsius_is_no_difference(text: str) -> None:
    with pytest.raises(ExpressionTypeError, match="can only be compared") as refused:
        TypeChecker(Scope(_TEMPERATURES)).check(parse(text))
    assert refused.value.code == "AE204"
    assert refused.value.cure is not None
    assert "K" in refused.value.cure


def test_a_temperature_in_degrees_celsius_may_be_the_whole_expression() -> None:
    assert TypeChecker(Scope({})).check(parse("20 °C")).term == t.Literal(
        Fraction("293.15"), RealType(TEMPERATURE)
    )


def literals_of(term: t.Term) -> list[t.Literal]:
    found = [one for child in t.children(term) for one in literals_of(child)]
    return [term, *found] if isinstance(term, t.Literal) else found
