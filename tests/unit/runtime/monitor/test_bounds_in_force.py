"""Bounds in force are those of the rules about each skill's latest action, until its step ends."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import pytest

from aeros.runtime.monitor.bounds_in_force import BoundInForce, BoundsInForce, scalars
from tests.unit.runtime.monitor.test_rule_bounds import SITE

MEASURED: dict[str, Any] = {"tool_speed": Fraction(1, 4), "human_distance": Fraction(2)}


def found(actions: BoundsInForce) -> dict[tuple[str, str], BoundInForce]:
    return {(one.rule, one.name): one for one in actions.find(MEASURED)}


def test_an_action_is_under_way_until_its_skill_ends() -> None:
    actions = BoundsInForce()
    assert found(actions) == {}
    actions.begin("m.s", SITE, "move_tool", {"speed": 0.25, "target": [0.0, 0.0, 0.5]})
    there = found(actions)
    speed = there["tool-speed", "tool_speed"]
    assert (speed.value, speed.bound.value, speed.is_requested) == (Fraction(1, 4), Fraction(17, 10), False)
    assert speed.declared is SITE.state["tool_speed"]
    asked = there["cell-speed", "move_tool.speed"]
    assert (asked.value, asked.is_requested) == (Fraction(1, 4), True)
    assert asked.declared is SITE.kinds["move_tool"].parameters["speed"]
    actions.end("m.s")
    actions.end("m.s")
    assert found(actions) == {}


def test_a_later_action_of_the_skill_replaces_the_first() -> None:
    actions = BoundsInForce()
    actions.begin("m.s", SITE, "move_tool", {"speed": 0.25})
    actions.begin("m.s", SITE, "wait", {"duration": 1.0})
    actions.begin("m.s", SITE, "no kind of this site", {})
    assert ("cell-speed", "move_tool.speed") not in found(actions)


@pytest.mark.parametrize("value", [None, [1.0], [1.0, 2.0, "x"], [1.0, 2.0, float("nan")], True])
def test_a_value_of_another_form_has_no_scalars(value: Any) -> None:
    assert scalars(SITE.state["tool_position"], value) == ()


def test_a_value_is_split_into_exact_scalars() -> None:
    assert list(scalars(SITE.state["tool_position"], (1.0, 2.0, 0.1))) == [
        ("tool_position.x", 1),
        ("tool_position.y", 2),
        ("tool_position.z", Fraction(0.1)),
    ]
    assert list(scalars(SITE.state["holding"], True)) == [("holding", True)]
