"""Predicates by definition are explained by the measured values in their definitions."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any

from aeros.agent.world.definitions import definition_causes
from aeros.agent.world.world import WorldModel, world_from_readings
from aeros.runtime.ports import Reading
from aeros.spec.model.cause import Cause, file_and_line
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.perception import Definition
from tests.unit.agent.dumplings import SPAN, STATE, module, term

DEFINED = {
    "wrapper_aligned": "fill_level <= 0.5 and area == pot",
    "dumpling_wrapped": "wrapper_aligned and dough_on_workspace",
}


def kitchen() -> dict[str, Ecm]:
    definitions = {name: Definition(term(text), text, SPAN) for name, text in DEFINED.items()}
    return {"kitchen": replace(module("kitchen", ()), definitions=definitions)}


def world(**values: Any) -> WorldModel:
    return world_from_readings(STATE, {name: Reading(value, 1.0) for name, value in values.items()}, 1.0)


def causes(condition: str, **values: Any) -> tuple[Cause, ...]:
    seen = world(**values)
    return definition_causes(seen, seen.unmet_parts(term(condition)), kitchen())


def test_a_false_predicate_is_explained_by_the_bounds_that_are_not_met() -> None:
    (found,) = causes("wrapper_aligned", wrapper_aligned=False, fill_level=0.75, area="pot")
    assert str(found) == "wrapper_aligned: fill_level is 0.75 (at most 0.5)"
    assert (found.kind, found.text) == ("definition", DEFINED["wrapper_aligned"])
    assert found.location == file_and_line(SPAN)


def test_a_definition_that_reads_another_is_explained_down_to_what_was_measured() -> None:
    found = causes(
        "dumpling_wrapped",
        dumpling_wrapped=False,
        wrapper_aligned=False,
        dough_on_workspace=True,
        fill_level=0.2,
        area="table",
    )
    assert [str(one) for one in found] == [
        "dumpling_wrapped: wrapper_aligned is false",
        "wrapper_aligned: area is table (exactly pot)",
    ]


def test_a_predicate_that_should_be_false_is_explained_by_what_makes_it_true() -> None:
    (found,) = causes("not wrapper_aligned", wrapper_aligned=True, fill_level=0.25, area="pot")
    assert [part.quantity for part in found.shortfalls] == ["fill_level", "area"]


def test_an_unknown_predicate_is_explained_by_the_readings_that_are_unknown() -> None:
    (found,) = causes("wrapper_aligned", area="pot")
    assert str(found) == "wrapper_aligned: `fill_level` is not measured"


def test_a_predicate_within_its_margin_is_explained_by_value_and_uncertainty() -> None:
    level = replace(STATE["fill_level"], uncertainty=Fraction(1, 20))
    modules = kitchen()
    definitions = {
        name: replace(one, margin=Fraction(2)) for name, one in modules["kitchen"].definitions.items()
    }
    modules["kitchen"] = replace(modules["kitchen"], definitions=definitions, state={"fill_level": level})
    seen = world(fill_level=0.4375, area="pot")
    (found,) = definition_causes(seen, seen.unmet_parts(term("wrapper_aligned")), modules)
    assert str(found) == (
        "wrapper_aligned: `fill_level` is 0.4375, too near to a bound for the margin of 2 times its "
        "uncertainty, 0.05"
    )
    unseen = world(area="pot")
    (found,) = definition_causes(unseen, unseen.unmet_parts(term("wrapper_aligned")), modules)
    assert str(found) == "wrapper_aligned: `fill_level` is not measured"


def test_predicates_and_numbers_without_a_definition_are_left_out() -> None:
    assert causes("dumpling_cooked and fill_level > 0.5", dumpling_cooked=False, fill_level=0.1) == ()
