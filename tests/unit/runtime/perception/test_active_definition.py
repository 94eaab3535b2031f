"""A definition has a value only while all that it reads is measured, fresh and well-formed."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from math import nan
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.runtime.perception.active_definition import ActiveDefinition
from aeros.runtime.ports import Reading
from aeros.spec.elaborate.scopes import state_scope
from aeros.spec.expr import terms as t
from aeros.spec.expr.parser import parse
from aeros.spec.expr.semantics import Value, is_true
from aeros.spec.expr.typecheck.check import check
from aeros.spec.expr.types import BOOL, RealType
from aeros.spec.expr.units import LENGTH
from aeros.spec.model.perception import Definition
from tests.unit.runtime.perception.kettle import full_site, site

NOW = 20.0
TEXT = "tool_position.x >= 400 mm and human_distance > 1 m"


def definition(text: str = TEXT) -> Definition:
    return Definition(check(parse(text), state_scope(full_site()), BOOL), text, site().span)


def evaluate(text: str = TEXT, **readings: Any) -> Reading | None:
    return ActiveDefinition(definition(text), full_site()).evaluate(readings, NOW)


def measured(x: float = 0.5, distance: float = 3.0, age: float = 0.0) -> dict[str, Any]:
    return {
        "tool_position": Reading((x, 0.0, 0.3), NOW - age),
        "human_distance": Reading(distance, NOW),
    }


@given(x=st.floats(-1.0, 1.0), distance=st.floats(0.0, 8.0))
def test_it_has_the_value_that_the_definition_of_the_language_gives(x: float, distance: float) -> None:
    exact: dict[str, Value] = {
        "tool_position": (Fraction(x), Fraction(0), Fraction(0.3)),
        "human_distance": Fraction(distance),
    }
    value = evaluate(**measured(x, distance))
    assert value == Reading(is_true(definition().term, exact), NOW)


def test_it_is_as_old_as_the_oldest_reading_in_it() -> None:
    assert evaluate(**measured(age=0.01)) == Reading(True, NOW - 0.01)


@pytest.mark.parametrize(
    "change",
    [
        {"human_distance": None},
        {"human_distance": Reading(nan, NOW)},
        {"human_distance": Reading(True, NOW)},
        {"human_distance": Reading(3.0, NOW + 1.0)},
        {"human_distance": 3.0},
        {"tool_position": Reading((0.5, 0.0, 0.3), NOW - 10.0)},
        {"tool_position": Reading((0.5, 0.0), NOW)},
    ],
)
def test_it_is_unknown_where_anything_that_it_reads_is(change: dict[str, Any]) -> None:
    assert evaluate(**{**measured(), **change}) is None


def test_it_is_unknown_where_the_site_does_not_know_a_variable() -> None:
    about = definition("kettle.water_hot and human_distance > 1 m")
    hot = {**measured(), "kettle.water_hot": Reading(True, NOW)}
    assert ActiveDefinition(about, full_site()).evaluate(hot, NOW) == Reading(True, NOW)
    assert ActiveDefinition(about, site()).evaluate(hot, NOW) is None


LEVEL = "level >= 50 mm"


@pytest.mark.parametrize(
    ("margin", "level", "value"),
    [
        (0, 0.0501, True),
        (2, 0.0501, None),
        (2, 0.0521, True),
        (2, 0.0499, None),
        (2, 0.0479, False),
        (3, 0.0521, None),
    ],
)
def test_within_the_margin_of_the_uncertainty_it_is_unknown(
    margin: int, level: float, value: bool | None
) -> None:
    level_ = t.Variable("level", RealType(LENGTH), t.VariableRole.STATE)
    declared = replace(full_site().state["human_distance"], variable=level_, uncertainty=Fraction(1, 1000))
    where = replace(full_site(), state={"level": declared})
    condition = Definition(
        check(parse(LEVEL), state_scope(where), BOOL), LEVEL, site().span, Fraction(margin)
    )
    found = ActiveDefinition(condition, where).evaluate({"level": Reading(level, NOW)}, NOW)
    assert found == (None if value is None else Reading(value, NOW))
