"""Declared variables: ranges in doubles, and the facts that terms depend on."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from math import inf

from aeros.spec.expr.types import EnumType
from aeros.spec.model.variables import measured_by_site, members_of, ranges_of, relevant_facts
from tests.unit.agent.dumplings import STATE, state, term


def test_the_range_in_doubles_lies_inside_the_exact_range() -> None:
    third = state("third", range_=(Fraction(1, 3), Fraction(2, 3)))
    low, high = third.double_range
    assert Fraction(1, 3) <= Fraction(low) < Fraction(high) <= Fraction(2, 3)
    assert state("truth").double_range == (-inf, inf)


def test_each_real_scalar_has_the_range_of_its_variable() -> None:
    ranges = ranges_of(STATE.values())
    assert ranges["fill_level"] == (Fraction(0), Fraction(1))
    assert ranges["joint[j1]"] == ranges["joint[j2]"] == (Fraction(-3), Fraction(3))
    assert {name for name in ranges if name.startswith("tool")} == {"tool.x", "tool.y", "tool.z"}
    assert "area" not in ranges


def test_facts_bring_in_the_variables_that_they_read() -> None:
    fact = term("dumpling_wrapped implies wrapper_aligned")
    known = {**STATE, "dumpling_wrapped": replace(STATE["dumpling_wrapped"], known_facts=(fact,))}
    condition = term("dumpling_wrapped or dumpling_cooked")
    variables, whole = relevant_facts([condition], known)
    assert [one.name for one in variables] == ["wrapper_aligned", "dumpling_wrapped", "dumpling_cooked"]
    assert whole == (condition, fact)


def test_members_are_those_of_the_enum_by_the_short_name() -> None:
    side = replace(STATE["fill_level"].variable, type=EnumType("side", ("left", "right")))
    known = {"garden.side": replace(STATE["fill_level"], variable=side), "wet": STATE["dumpling_wrapped"]}
    assert members_of(known) == {"side": ("left", "right"), "wet": ()}


def test_sensors_of_the_site_have_no_module_before_their_name() -> None:
    known = {
        name: replace(STATE["fill_level"], sensor=sensor)
        for name, sensor in (("a.tap", "survey"), ("a.bed", "a.see"), ("a.side", "a.the instruction"))
    }
    assert measured_by_site({**known, "a.input": replace(STATE["fill_level"], sensor=None)}) == ("a.tap",)
