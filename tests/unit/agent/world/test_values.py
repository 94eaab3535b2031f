"""Values against their declarations: exact, or refused with the reason."""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.agent.world.values import CachingConverter, UnusableValueError, to_exact, to_json_value
from aeros.agent.world.world import world_from_readings
from aeros.runtime.ports import Reading
from aeros.spec.expr.semantics import Value
from aeros.spec.expr.types import IntegerType, RealType
from aeros.spec.expr.units import NUMBER
from aeros.spec.model.variables import Declared
from tests.unit.agent.dumplings import STATE, state

NOW = 100.0


@given(
    st.fractions(-2, 2, max_denominator=1000),
    st.fractions(0, 2, max_denominator=1000),
    st.sampled_from([-1, 0, 1]),
    st.one_of(st.floats(-3.0, 3.0), st.integers(-3, 3), st.none()),
)
def test_ranges_are_compared_exactly(low: Fraction, width: Fraction, steps: int, other: float | None) -> None:
    declared = replace(STATE["fill_level"], range=(low, low + width))
    # Most doubles are far from a bound: so is the nearest to it taken, and its neighbours.
    near = math.nextafter(float(low + width), math.inf * steps) if steps else float(low + width)
    value = near if other is None else other
    try:
        found = to_exact(declared, value)
    except UnusableValueError:
        assert not low <= Fraction(value) <= low + width
    else:
        assert found == Fraction(value)
        assert low <= Fraction(value) <= low + width


def test_values_that_are_kept_are_those_that_are_measured() -> None:
    kept = CachingConverter()
    for value in (True, True, False, 1, "yes", True):
        readings = {"wrapper_aligned": Reading(value, NOW)}
        assert world_from_readings(STATE, readings, NOW, kept) == world_from_readings(STATE, readings, NOW)


def test_a_list_that_has_changed_is_not_kept_and_neither_is_what_is_declared_otherwise() -> None:
    kept, place, fixed = CachingConverter(), [0.1, 0.0, 1.0], (0.1, 0.0, 1.0)
    assert kept(STATE["tool"], place) == to_exact(STATE["tool"], place)
    place[0] = 0.2
    assert kept(STATE["tool"], place) == to_exact(STATE["tool"], place)
    assert kept(STATE["tool"], fixed) == kept(STATE["tool"], fixed) == to_exact(STATE["tool"], fixed)
    with pytest.raises(UnusableValueError):
        kept(replace(STATE["tool"], range=(Fraction(0), Fraction(1, 2))), fixed)


@pytest.mark.parametrize(
    ("name", "value", "exact"),
    [
        ("wrapper_aligned", False, False),
        ("area", "pot", "pot"),
        ("fill_level", 0.25, Fraction(1, 4)),
        ("fill_level", 1, Fraction(1)),
        ("fill_level", Fraction(1, 3), Fraction(1, 3)),
        ("tool", [0, 0.5, 1], (Fraction(0), Fraction(1, 2), Fraction(1))),
        ("joint", (1.0, -3.0), (Fraction(1), Fraction(-3))),
    ],
)
def test_a_value_that_fits_becomes_exact(name: str, value: Any, exact: Any) -> None:
    found = to_exact(STATE[name], value)
    assert found == exact
    assert type(found) is type(exact)


@pytest.mark.parametrize(
    ("name", "value", "why"),
    [
        ("wrapper_aligned", 0, "is of type int, which is not bool"),
        ("area", "floor", "is 'floor', which is none of table, pot"),
        ("area", True, "is of type bool"),
        ("fill_level", math.nan, "is not finite"),
        ("fill_level", -math.inf, "is not finite"),
        ("fill_level", 1.5, "is outside 0 … 1 (SI)"),
        ("fill_level", Fraction(-1, 10**30), "is outside 0 … 1 (SI)"),
        ("tool", (0.0, 0.0), "is of type tuple"),
        ("tool", (0.0, 0.0, 2.0), "is outside -1 … 1 (SI)"),
        ("joint", [0.0, 0.0], "is of type list"),
        ("joint", (0.0,), "is of type tuple"),
    ],
)
def test_a_value_that_does_not_fit_is_refused_with_the_reason(name: str, value: Any, why: str) -> None:
    with pytest.raises(UnusableValueError) as refused:
        to_exact(STATE[name], value)
    assert str(refused.value).startswith(why)


def test_a_bound_between_two_doubles_holds_exactly() -> None:
    third = replace(STATE["fill_level"], range=(Fraction(0), Fraction(1, 3)))
    assert to_exact(third, Fraction(1, 3)) == Fraction(1, 3)
    assert to_exact(third, 1 / 3) == Fraction(1 / 3)  # the nearest double is below
    with pytest.raises(UnusableValueError, match="is outside"):
        to_exact(third, math.nextafter(1 / 3, 1.0))


def test_a_whole_number_has_no_fraction() -> None:
    count = state("count", IntegerType(), (Fraction(0), Fraction(9)))
    assert to_exact(count, 3.0) == Fraction(3)
    with pytest.raises(UnusableValueError, match="is not a whole number"):
        to_exact(count, 2.5)


def test_without_a_range_every_finite_number_fits() -> None:
    anything = state("anything", RealType(NUMBER))
    assert to_exact(anything, -1e300) == Fraction(-1e300)
    assert to_exact(anything, 10**400) == 10**400


def test_the_same_object_is_converted_once_and_another_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    converted: list[Any] = []

    def counting(declared: Declared, value: Any) -> Value:
        converted.append(value)
        return to_exact(declared, value)

    monkeypatch.setattr("aeros.agent.world.values.to_exact", counting)
    kept, place = CachingConverter(), (0.1, 0.0, 1.0)
    same = (*place,)  # a copy
    other = replace(STATE["tool"], max_age=Fraction(1))
    for declared, value in (
        (STATE["tool"], place),
        (STATE["tool"], place),
        (STATE["tool"], same),
        (other, same),
    ):
        assert kept(declared, value) == to_exact(declared, place)
    assert converted == [place, same, same]


@pytest.mark.parametrize(
    ("value", "json"),
    [
        (Fraction(1, 4), 0.25),
        ((Fraction(1), (Fraction(2), True)), [1.0, [2.0, True]]),
        ("pot", "pot"),
        (True, True),
        (None, None),
        ((), []),
    ],
)
def test_an_exact_value_has_a_json_value(value: Any, json: Any) -> None:
    found = to_json_value(value)
    assert found == json
    assert type(found) is type(json)
