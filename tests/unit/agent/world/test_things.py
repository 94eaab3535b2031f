"""A thing is known as far as the variables that describe it are."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any

import pytest

from aeros.agent.world.things import ThingState, things_of
from aeros.agent.world.world import WorldModel, world_from_readings
from aeros.runtime.ports import Reading
from aeros.spec.expr.types import IntegerType, VectorType
from aeros.spec.expr.units import LENGTH, NUMBER
from aeros.spec.model.perception import Thing
from tests.unit.agent.dumplings import DUMPLING, STATE, state, term

HERE = (Fraction(-2), Fraction(2))
DECLARED = STATE | {
    "place": state("place", VectorType(LENGTH), HERE),
    "cooked": state("cooked", IntegerType(NUMBER), (Fraction(0), Fraction(9))),
}
WRAPPER = Thing(
    "dumpling.wrapper",
    "wrapper",
    position="place",
    count="cooked",
    held=term("dumpling_wrapped"),
    relations={"on press": term("wrapper_aligned"), "in pot": term("dumpling_cooked")},
)


def world(**values: Any) -> WorldModel:
    return world_from_readings(DECLARED, {name: Reading(one, 1.0) for name, one in values.items()}, 1.0)


def states(thing: Thing, **values: Any) -> list[ThingState]:
    return list(things_of(world(**values), [replace(DUMPLING, things={"it": thing})]))


def test_a_thing_has_what_is_measured_and_the_relations_that_are_known() -> None:
    (found,) = states(WRAPPER, place=(0.5, 0.25, 0.0), cooked=2, dumpling_wrapped=True, wrapper_aligned=False)
    assert found.to_json() == {
        "kind": "wrapper",
        "position": [0.5, 0.25, 0.0],
        "count": 2,
        "held": True,
        "relations": {"on press": False},
    }
    assert found.measured_by == {"position": "place", "count": "cooked"}
    assert found.derived_from == {
        "position": ("place",),
        "count": ("cooked",),
        "held": ("dumpling_wrapped",),
        "on press": ("wrapper_aligned",),
        "in pot": ("dumpling_cooked",),
    }


def test_a_thing_of_which_only_the_kind_is_known_is_not_there() -> None:
    assert states(WRAPPER) == []
    assert states(Thing("dumpling.spoon", "spoon")) == []


@pytest.mark.parametrize(("known", "kind"), [({"area": "pot"}, "pot"), ({}, None)])
def test_the_kind_may_be_that_which_the_task_asks_for(known: dict[str, str], kind: str | None) -> None:
    asked = replace(WRAPPER, kind="", kind_from="area")
    (found,) = states(asked, wrapper_aligned=True, **known)
    assert found.kind == kind
    assert found.derived_from["on press"] == ("area", "wrapper_aligned")
    assert found.relations == {"on press": True}
