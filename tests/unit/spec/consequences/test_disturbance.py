"""Readings that a skill may change: by actuators, tools and effects, and those that change by themselves."""

from __future__ import annotations

from dataclasses import replace

import pytest

from aeros.spec.consequences.disturbance import (
    disturbed_by_actions,
    disturbed_by_changes,
    disturbed_by_effects,
    is_moved,
    readings_behind,
)
from tests.unit.agent.dumplings import outcome
from tests.unit.spec.consequences.places import DEFINITIONS, asking, site


@pytest.mark.parametrize(
    ("reading", "by_driving", "by_waiting"),
    [
        ("base", True, False),
        ("m.dock", False, False),
        ("distance", True, True),
        ("m.cup", False, False),
        ("holding", False, False),
        ("m.count", False, False),
        ("unheard_of", True, True),
    ],
)
def test_a_reading_is_moved_unless_site_and_manifest_exclude_it(
    reading: str, by_driving: bool, by_waiting: bool
) -> None:
    assert is_moved(reading, asking("go"), site()) is by_driving
    assert is_moved(reading, asking("stay", kinds=("wait",)), site()) is by_waiting


def test_a_sensor_without_an_entry_may_always_change() -> None:
    assert is_moved("base", asking("stay", kinds=("wait",)), replace(site(), moved_by={}))


def test_answers_of_a_tool_change_in_skills_that_may_call_it() -> None:
    assert is_moved("m.time", asking("ask", kinds=("ask",)), site())
    assert not is_moved("m.time", asking("go"), site())


def test_readings_are_found_through_other_definitions() -> None:
    assert set(readings_behind("m.alone", DEFINITIONS)) == {"distance", "m.free", "holding", "m.count"}


def test_actions_disturb_the_predicates_of_what_they_move() -> None:
    distance = "`distance` (`moved_by` of the site has no entry for `scanner`, which measures it)"
    disturbed = {"m.docked": "`base`", "m.far": "`base`", "m.alone": distance}
    assert disturbed_by_actions(asking("go"), DEFINITIONS, site()) == disturbed
    assert disturbed_by_actions(asking("stay", kinds=("wait",)), DEFINITIONS, site()) == {"m.alone": distance}


def test_effects_disturb_the_predicates_of_what_they_set_at_any_depth() -> None:
    found = disturbed_by_effects(outcome("dropped", {"holding": False}), DEFINITIONS)
    assert found == {"m.free": "`holding`", "m.alone": "`holding`"}
    assert disturbed_by_changes(["m.free"], DEFINITIONS) == {"m.alone": "`m.free`"}
    assert disturbed_by_effects(outcome("nothing", {}), DEFINITIONS) == {}
