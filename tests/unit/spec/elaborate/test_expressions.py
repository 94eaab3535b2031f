"""Expression fields become typed terms, and faults are underlined where they are written."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import pytest

from aeros.spec.diagnostics.codes import Diagnostic, Diagnostics
from aeros.spec.elaborate.expressions import (
    elaborate_condition,
    elaborate_constant,
    elaborate_expression,
    elaborate_number,
    elaborate_quantity,
    elaborate_unit,
)
from aeros.spec.expr import terms as t
from aeros.spec.expr.scope import Scope
from aeros.spec.expr.types import BOOL, RealType
from aeros.spec.expr.units import LENGTH, NUMBER, TIME
from aeros.spec.text.fields import ExpressionField, TextField
from tests.unit.spec.text.reading import value_of

NEAR = t.Variable("near", BOOL, t.VariableRole.STATE)
BUSY = t.Variable("busy", BOOL, t.VariableRole.STATE)
LOAD = t.Variable("load", RealType(NUMBER), t.VariableRole.STATE)
NOTHING = Scope({})
SCOPE = Scope(
    {"near": NEAR, "busy": BUSY, "load": LOAD}, {}, {"half": t.Literal(Fraction(1, 2), RealType(NUMBER))}
)


def _expression(text: str) -> ExpressionField:
    node = value_of(f"require: {text}\n")
    return ExpressionField(node.text, node.span, node)


def _text(text: str) -> TextField:
    node = value_of(f"unit: {text}\n")
    return TextField(node.text, node.span, node)


def _refused(elaborate: Callable[[Diagnostics], Any]) -> Diagnostic:
    sink = Diagnostics()
    assert elaborate(sink) is None
    (found,) = sink
    return found


def _underlined(found: Diagnostic) -> str:
    assert found.primary is not None
    return found.primary.span.text


def test_an_expression_becomes_a_term() -> None:
    sink = Diagnostics()
    assert elaborate_expression(_expression("near"), SCOPE, sink) == NEAR
    assert elaborate_expression(_expression("load"), SCOPE, sink, RealType(NUMBER)) == LOAD
    assert not list(sink)


@pytest.mark.parametrize(
    ("text", "code", "underlined"),
    [
        ("near and (busy", "AE201", ""),
        ("near and bsy", "AE202", "bsy"),
        ("near and load", "AE203", "load"),
        ("load <= 3 mm", "AE204", None),
    ],
)
def test_a_fault_is_underlined_in_the_file(text: str, code: str, underlined: str | None) -> None:
    found = _refused(lambda sink: elaborate_expression(_expression(text), SCOPE, sink))
    assert found.code == code
    if underlined is not None:
        assert _underlined(found) == underlined


def test_a_misspelt_name_comes_with_a_cure() -> None:
    assert _refused(lambda sink: elaborate_expression(_expression("bsy"), SCOPE, sink)).help == (
        "did you mean `busy`?",
    )


def test_two_sides_of_different_units_are_both_labelled() -> None:
    found = _refused(lambda sink: elaborate_expression(_expression("load <= 3 mm"), SCOPE, sink))
    assert found.primary is not None
    (other,) = found.secondary
    assert {_underlined(found), other.span.text} == {"load", "3 mm"}


def test_a_condition_of_several_conjuncts_has_each_with_its_place() -> None:
    found = elaborate_condition(_expression("near and not busy"), SCOPE, Diagnostics())
    assert found is not None
    assert [one.span.text for one in found.conjuncts] == ["near", "not busy"]
    assert [one.term for one in found.conjuncts] == [NEAR, t.Not(BUSY)]


@pytest.mark.parametrize("text", ["near", "near or busy"])
def test_a_condition_without_conjuncts_is_its_own(text: str) -> None:
    field = _expression(text)
    found = elaborate_condition(field, SCOPE, Diagnostics())
    assert found is not None
    (whole,) = found.conjuncts
    assert (whole.term, whole.span) == (found.term, field.span)


def test_premises_and_alternatives_of_a_condition_have_their_places() -> None:
    found = elaborate_condition(_expression("near implies load <= half"), SCOPE, Diagnostics())
    assert found is not None
    assert [one.span.text for one in found.premises] == ["near"]
    assert [one.span.text for one in found.alternatives] == ["load <= half"]


def test_a_condition_with_a_fault_is_reported() -> None:
    assert _refused(lambda sink: elaborate_condition(_expression("load"), SCOPE, sink)).code == "AE203"


def test_a_constant_is_evaluated_in_si() -> None:
    sink = Diagnostics()
    assert elaborate_constant(_expression("250 mm"), NOTHING, sink, RealType(LENGTH)) == Fraction(1, 4)
    assert elaborate_constant(_expression("1 < 2"), NOTHING, sink, BOOL) is True
    assert not list(sink)
    refused = _refused(lambda one: elaborate_constant(_expression("1 s"), NOTHING, one, RealType(LENGTH)))
    assert refused.code == "AE204"


def test_a_number_has_the_dimension_of_its_units() -> None:
    sink = Diagnostics()
    assert elaborate_number(_expression("2 * 250 mm"), NOTHING, sink) == t.Literal(
        Fraction(1, 2), RealType(LENGTH)
    )
    assert elaborate_number(_expression("3"), NOTHING, sink) == t.Literal(Fraction(3), RealType(NUMBER))
    assert not list(sink)


@pytest.mark.parametrize(("text", "code"), [("1 < 2", "AE203"), ("1 +", "AE201"), ("nobody", "AE202")])
def test_values_that_are_no_numbers_are_refused(text: str, code: str) -> None:
    assert _refused(lambda sink: elaborate_number(_expression(text), NOTHING, sink)).code == code


def test_a_truth_for_a_number_is_underlined_whole() -> None:
    found = _refused(lambda sink: elaborate_number(_expression("1 < 2"), NOTHING, sink))
    assert found.headline == "expected a number, found bool"
    assert _underlined(found) == "1 < 2"


def test_a_unit_is_read_and_absent_is_a_bare_number() -> None:
    sink = Diagnostics()
    millimetres, none = elaborate_unit(_text("mm"), sink), elaborate_unit(None, sink)
    assert millimetres is not None
    assert none is not None
    assert (millimetres.factor, millimetres.dimension) == (Fraction(1, 1000), LENGTH)
    assert (none.factor, none.dimension) == (Fraction(1), NUMBER)
    assert not list(sink)
    found = _refused(lambda one: elaborate_unit(_text("furlong"), one))
    assert (found.code, found.headline, _underlined(found)) == ("AE207", "`furlong` is not a unit", "furlong")


def test_a_quantity_is_converted_to_si() -> None:
    sink = Diagnostics()
    assert elaborate_quantity(_text("250 ms"), TIME, sink) == Fraction(1, 4)
    assert elaborate_quantity(_text("-2 s"), TIME, sink) == -2
    assert not list(sink)


@pytest.mark.parametrize(
    ("text", "code", "headline"),
    [
        ("soon", "AE207", "`soon` is not a number with a unit"),
        ("250 mm", "AE204", f"expected a value in {TIME}, found {LENGTH}"),
    ],
)
def test_a_quantity_of_another_form_or_dimension_is_refused(text: str, code: str, headline: str) -> None:
    found = _refused(lambda sink: elaborate_quantity(_text(text), TIME, sink))
    assert (found.code, found.headline, _underlined(found)) == (code, headline, text)
