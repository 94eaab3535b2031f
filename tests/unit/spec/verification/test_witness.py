from __future__ import annotations

from fractions import Fraction

import pytest

from aeros.spec.backends.solver_results import ScalarValue
from aeros.spec.diagnostics.source import Source
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import Value
from aeros.spec.expr.types import BOOL, EnumType, FamilyType, RealType, Type, VectorType
from aeros.spec.expr.units import LENGTH, parse_unit
from aeros.spec.model.variables import Declared
from aeros.spec.verification.witness import TermEvaluator, Witness, format_value, witness_from_model

SPAN = Source("site.yaml", "x").span(0, 1)
SIDES = EnumType("sides", ("left", "right"))
METRES = RealType(LENGTH)


def declared(name: str, type_: Type, unit: str = "1", high: str = "10") -> Declared:
    found = parse_unit(unit)
    assert found is not None
    numeric = not (type_ == BOOL or isinstance(type_, EnumType))
    bounds = (Fraction(0), Fraction(high)) if numeric else None
    return Declared(t.Variable(name, type_, t.VariableRole.STATE), SPAN, found, bounds)


GAP = declared("gap", METRES, "mm")
PLACE = declared("place", VectorType(LENGTH), "mm")
READY = declared("ready", FamilyType(SIDES, BOOL))
SIDE = declared("side", SIDES)


def metres(value: str) -> t.Literal:
    return t.Literal(Fraction(value), METRES)


def shown(model: dict[str, ScalarValue], one: Declared, *wanted: t.Term) -> list[str] | None:
    found = witness_from_model(model, (one,), wanted, TermEvaluator(), shown=True)
    return None if found is None else found.lines()


@pytest.mark.parametrize(
    ("value", "one", "text"),
    [
        (True, declared("b", BOOL), "true"),
        ("left", SIDE, "left"),
        (Fraction(1, 4), GAP, "250 mm"),
        ((Fraction(1, 4), Fraction(0), Fraction(-1)), PLACE, "[250, 0, -1000] mm"),
        ((True, False), READY, "[true, false]"),
        (Fraction(1, 3), declared("ratio", METRES, "m"), "≈0.333333333 m"),
    ],
    ids=str,
)
def test_a_value_is_shown_in_the_unit_of_its_declaration(value: Value, one: Declared, text: str) -> None:
    assert format_value(value, one) == text


def test_a_number_is_rounded_where_a_rounded_one_does_as_well() -> None:
    above = t.Compare("<", metres("0.1"), GAP.variable)
    assert shown({"gap": Fraction(123456789, 10**9)}, GAP, above) == ["gap = 123 mm"]


def test_a_number_keeps_the_digits_that_the_claim_needs() -> None:
    between = t.And(
        (t.Compare("<", metres("0.1"), GAP.variable), t.Compare("<", GAP.variable, metres("0.1002")))
    )
    assert shown({"gap": Fraction(100123, 10**6)}, GAP, between) == ["gap = 100.1 mm"]


def test_a_number_is_not_rounded_out_of_its_range() -> None:
    one = declared("gap", METRES, "m", high="0.5")
    assert shown({"gap": Fraction(1, 2)}, one, t.TRUE) == ["gap = 0 m"]
    high = t.Compare("<", metres("0.4"), one.variable)
    assert shown({"gap": Fraction(1, 2)}, one, high) == ["gap = 0.5 m"]


def test_a_model_that_is_not_a_witness_is_none() -> None:
    assert shown({"gap": Fraction(1)}, GAP, t.Compare("<", GAP.variable, metres("1"))) is None
    assert witness_from_model({"gap": Fraction(1)}, (GAP,), (t.FALSE,), TermEvaluator(), shown=False) is None


def test_a_model_out_of_range_is_none() -> None:
    assert shown({"gap": Fraction(11)}, GAP, t.TRUE) is None
    assert shown({"place.x": Fraction(0), "place.y": Fraction(-1), "place.z": Fraction(0)}, PLACE) is None


def test_vectors_and_families_are_put_together_in_order() -> None:
    model: dict[str, ScalarValue] = {"ready[left]": True, "ready[right]": False}
    found = witness_from_model(
        model, (READY,), (t.Select(READY.variable, t.Literal("left", SIDES)),), TermEvaluator(), shown=False
    )
    assert found == Witness((READY,), {"ready": (True, False)})


def test_a_witness_that_is_not_shown_is_not_rounded() -> None:
    found = witness_from_model({"gap": Fraction(1, 7)}, (GAP,), (t.TRUE,), TermEvaluator(), shown=False)
    assert found is not None
    assert found.values == {"gap": Fraction(1, 7)}
