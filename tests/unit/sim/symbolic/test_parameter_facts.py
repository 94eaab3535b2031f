"""Predicates that depend on a parameter are kept for each of its values."""

from __future__ import annotations

from aeros.sim.symbolic.parameter_facts import ParameterFacts
from tests.unit.agent.instructions.lists.reference import reference_modules

OBJECT, GRASPED = "fetch_object.object", "fetch_object.object_grasped"
WIPED = "clean_table.table_wiped"
INITIAL = {GRASPED: False, WIPED: False}


def test_only_predicates_that_depend_on_the_changed_parameter_change() -> None:
    facts = ParameterFacts(reference_modules())
    assert facts.defaults == {
        OBJECT: "red_can",
        "fetch_object.to": "anywhere",
        "clean_table.region": "whole",
        "make_dumplings.count": 1.0,
    }
    assert facts.change({OBJECT: "red_can"}, {}, INITIAL) == {}
    now = {GRASPED: True, WIPED: True}
    changed = facts.change({OBJECT: "blue_block"}, now, INITIAL)
    assert (changed[OBJECT], changed[GRASPED]) == ("blue_block", False)
    assert WIPED not in changed
    assert facts.change({}, {**now, GRASPED: False}, INITIAL)[GRASPED] is True


def test_a_new_run_begins_with_the_defaults() -> None:
    facts = ParameterFacts(reference_modules())
    facts.change({OBJECT: "blue_block"}, {GRASPED: True, WIPED: False}, INITIAL)
    facts.restart()
    assert facts.change({OBJECT: "blue_block"}, {GRASPED: False, WIPED: False}, INITIAL)[GRASPED] is False
