"""The planner by rules: each rule that is not measured as satisfied gives its step."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.agent.planning.base import RulePlanner
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import PlanStep
from aeros.agent.world.world import WorldModel, world_from_readings
from aeros.runtime.ports import Reading
from tests.unit.agent.dumplings import MAKE_DUMPLINGS, PREDICATES, STATE, rule, task, term

ROUTED = RoutedTask("dumpling", MAKE_DUMPLINGS)


def world(**values: Any) -> WorldModel:
    return world_from_readings(STATE, {name: Reading(value, 0.0) for name, value in values.items()}, 0.0)


def planned(**values: Any) -> list[str]:
    graph = RulePlanner().plan(ROUTED, world(**values), {})
    return [step.skill for step in graph.steps]


@pytest.mark.parametrize(
    ("measured", "skills"),
    [
        ({}, ["prepare", "recover", "wrap", "boil"]),
        (dict.fromkeys(PREDICATES, False), ["prepare", "recover", "wrap", "boil"]),
        ({"dough_on_workspace": True}, ["prepare", "recover", "wrap", "boil"]),
        ({"dough_on_workspace": True, "filling_on_workspace": True}, ["recover", "wrap", "boil"]),
        # `wrapper_aligned or dumpling_wrapped` is true whatever the alignment is.
        ({"dumpling_wrapped": True}, ["prepare", "boil"]),
        ({"wrapper_aligned": False}, ["prepare", "recover", "wrap", "boil"]),
        ({"dumpling_wrapped": True, "wrapper_aligned": False}, ["prepare", "boil"]),
        (dict.fromkeys(PREDICATES, True), []),
    ],
)
def test_a_rule_that_is_not_measured_as_satisfied_gives_a_step(
    measured: dict[str, bool], skills: list[str]
) -> None:
    assert planned(**measured) == skills


def test_a_step_has_all_that_its_rule_says() -> None:
    wrapping = replace(rule("dumpling_wrapped", "wrap", 2, "recover", "prepare"), inputs={"force": 0.5})
    routed = RoutedTask("dumpling", task("t", ("t",), "dumpling_cooked", wrapping))
    (step,) = RulePlanner().plan(routed, world(), {}).steps
    between, last = PlanStep("dumpling", "recover"), PlanStep("dumpling", "prepare")
    unless = term("dumpling_wrapped")
    assert step == PlanStep("dumpling", "wrap", {"force": 0.5}, 2, between, last, unless)


def test_its_name_in_the_record_is_rules() -> None:
    assert RulePlanner().name == "rules"


@given(st.dictionaries(st.sampled_from(PREDICATES), st.booleans()))
def test_the_order_is_that_of_the_rules(measured: dict[str, bool]) -> None:
    order = [one.skill for one in MAKE_DUMPLINGS.rules]
    skills = planned(**measured)
    assert skills == [name for name in order if name in skills]
