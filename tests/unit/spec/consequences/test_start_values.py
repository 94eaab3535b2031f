"""A start is refused if its stated values exclude each other by the definitions of predicates."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.consequences.start_values import (
    StartContradiction,
    find_start_contradiction,
    with_defined_predicates,
)
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import Environment, is_true
from aeros.spec.expr.types import RealType, VectorType
from aeros.spec.expr.units import NUMBER
from aeros.spec.model.perception import Definition
from tests.unit.agent.dumplings import SPAN, module, state, task
from tests.unit.spec.consequences.places import DEFINITIONS, TEXTS, site, term


def contradiction(**initial: Any) -> StartContradiction | None:
    values = {name.replace("m_", "m."): value for name, value in initial.items()}
    ecm = replace(module("m", ()), definitions=DEFINITIONS)
    return find_start_contradiction(
        ecm, replace(task("t", ("t",), "dumpling_cooked"), initial=values), site()
    )


def test_a_stated_predicate_must_agree_with_the_stated_readings() -> None:
    assert contradiction(base=Fraction(6), m_far=True) is None
    assert contradiction(base=Fraction(6), m_far=False) == StartContradiction(
        "m.far", False, TEXTS["m.far"], {"base": Fraction(6)}
    )
    assert contradiction(base=None, m_far=False) is None


def test_predicates_that_the_stated_values_decide_are_added() -> None:
    added = with_defined_predicates({"base": 6.0}, DEFINITIONS)
    assert added == {"base": 6.0, "m.far": True}
    assert with_defined_predicates({"base": 6.0, "m.far": False}, DEFINITIONS) == {
        "base": 6.0,
        "m.far": False,
    }
    assert with_defined_predicates({"base": None}, DEFINITIONS) == {"base": None}


def test_variables_that_are_not_stated_may_be_anything() -> None:
    assert contradiction() is None
    assert contradiction(m_docked=True, m_far=True) is None  # the dock may be anywhere
    assert contradiction(base=Fraction(1), m_docked=False) is None


def test_predicates_that_exclude_each_other_are_found_through_other_definitions() -> None:
    found = contradiction(m_free=False, m_alone=True)
    assert found is not None
    assert (found.predicate, found.values) == ("m.alone", {"m.free": False})
    assert contradiction(holding=True, m_free=True) is not None
    assert contradiction(holding=True, m_alone=True) is not None


def test_positions_count_component_by_component() -> None:
    place = replace(state("place", VectorType(NUMBER)), sensor="odometry")
    kitchen = site()
    kitchen = replace(kitchen, state={**kitchen.state, "place": place, "m.there": state("m.there")})
    five = t.Literal(Fraction(5), RealType(NUMBER))
    definition = Definition(t.Compare("<=", five, t.Component(place.variable, 1)), "place.y >= 5", SPAN)
    ecm = replace(module("m", ()), definitions={"m.there": definition})
    for y, is_there, is_found in ((6, True, False), (6, False, True), (4, True, True), (4, False, False)):
        start = {"place": (Fraction(0), Fraction(y), Fraction(0)), "m.there": is_there}
        one = replace(task("t", ("t",), "dumpling_cooked"), initial=start)
        assert (find_start_contradiction(ecm, one, kitchen) is not None) is is_found


_NUMBERS = st.integers(0, 8).map(Fraction)


@given(_NUMBERS, _NUMBERS, st.booleans(), st.booleans(), st.booleans())
def test_a_start_is_refused_exactly_where_no_state_has_its_values(
    base: Fraction, dock: Fraction, holding: bool, docked: bool, far: bool
) -> None:
    readings: Environment = {"base": base, "m.dock": dock, "holding": holding}
    is_so = {name: is_true(term(TEXTS[name]), readings) for name in ("m.docked", "m.far")}
    found = contradiction(base=base, m_dock=dock, holding=holding, m_docked=docked, m_far=far)
    assert (found is None) == (is_so == {"m.docked": docked, "m.far": far})
