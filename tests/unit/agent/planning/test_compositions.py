"""Compositions as plans, and where one is proposed."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from aeros.agent.planning.compositions import (
    CompositionPlanner,
    CompositionUnavailableError,
    composition_to_graph,
)
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import Part, PlanStep, TaskGraph
from aeros.agent.world.world import world_from_readings
from aeros.runtime.ports import Reading
from aeros.spec.model import composition as spec
from aeros.spec.model.step_graph import If, Par, Seq
from tests.unit.agent.dumplings import (
    MAKE_DUMPLINGS,
    SPAN,
    STATE,
    module,
    term,
)


def step(name: str, retry: int = 0, **more: Any) -> PlanStep:
    return PlanStep("kitchen", name, retry=retry, **more)


def par(*branches: Part) -> Par[PlanStep]:
    return Par(branches, SPAN)


def if_aligned(then: Part, otherwise: Part | None = None) -> If[PlanStep]:
    return If(term("wrapper_aligned"), "wrapper_aligned", then, otherwise, SPAN)


def _spec_step(name: str, retry: int = 0, between: str | None = None, flows: Any = None) -> spec.Step:
    return spec.Step(name, name, {}, flows or {}, retry, between, None, SPAN)


def test_a_composition_is_the_plan_that_it_says() -> None:
    both = (_spec_step("dough", 1, "align"), replace(_spec_step("filling"), on_failure=spec.STOP_ON_FAILURE))
    then: spec.Part = _spec_step("wrap")
    choice = If(term("wrapper_aligned"), "wrapper_aligned", then, Seq(()), SPAN)
    body: spec.Part = Seq((Par(both, SPAN), choice))
    handlers = {"align": _spec_step("align", 1, "water"), "water": _spec_step("water")}
    graph = composition_to_graph(
        spec.Composition("make", term("true"), None, body, handlers, SPAN), "kitchen"
    )
    water = step("water", id="water")
    helped = step(
        "dough",
        retry=1,
        between_tries=step("align", retry=1, between_tries=water, needs_recovery=True, id="align"),
        needs_recovery=True,
        id="dough",
    )
    chosen = if_aligned(step("wrap", id="wrap"), Seq(()))
    assert graph == TaskGraph((par(helped, step("filling", id="filling")), chosen))
    assert [str(part) for part in graph.parts] == [
        "(kitchen.dough (retry 1, between_tries align) ∥ kitchen.filling)",
        "(if wrapper_aligned then kitchen.wrap else nothing)",
    ]
    assert [one.skill for one in graph.steps] == ["dough", "filling", "wrap"]


def test_data_flows_as_the_composition_says() -> None:
    flowing = _spec_step("knead", flows={"force": spec.OutputReference("weigh", "force", SPAN)})
    graph = composition_to_graph(spec.Composition("make", term("true"), None, flowing, {}, SPAN), "kitchen")
    assert graph == TaskGraph((step("knead", id="knead", flows={"force": ("weigh", "force")}),))


@pytest.mark.parametrize(
    ("name", "measured", "why"),
    [
        ("make", True, None),
        ("make", False, "the precondition of `make` is not met: `wrapper_aligned` = False"),
        ("make", None, "the precondition of `make` is not met: `wrapper_aligned` is not measured"),
        ("bake", True, "`kitchen` has no composition `bake`"),
    ],
)
def test_a_composition_is_proposed_where_it_may_start(
    name: str, measured: bool | None, why: str | None
) -> None:
    composed = spec.Composition("make", term("wrapper_aligned"), SPAN, _spec_step("wrap"), {}, SPAN)
    modules = {"kitchen": replace(module("kitchen", ()), compositions={"make": composed})}
    readings = {} if measured is None else {"wrapper_aligned": Reading(measured, 0.0)}
    planner = CompositionPlanner(name)
    assert planner.name == f"composition {name}"
    world, routed = world_from_readings(STATE, readings, 0.0), RoutedTask("kitchen", MAKE_DUMPLINGS)
    if why is None:
        assert planner.plan(routed, world, modules) == TaskGraph((step("wrap", id="wrap"),))
    else:
        with pytest.raises(CompositionUnavailableError, match=why):
            planner.plan(routed, world, modules)
