"""Steps of plans that name a capability in place of a skill, so that the agent chooses a provider."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from aeros.agent.agent import start_agent
from aeros.agent.planning.provider_freedom import accepted_places, capability_steps, with_capabilities
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import PlanStep, TaskGraph
from aeros.agent.world.world import WorldModel
from aeros.spec.model.ecm import Ecm, Outcome
from aeros.spec.model.step_graph import If, steps_of
from tests.unit.agent.dumplings import (
    DUMPLING,
    FORCE,
    MAKE_DUMPLINGS,
    SPAN,
    given_input,
    module,
    outcome,
    skill,
    term,
)
from tests.unit.agent.fake_runtime import FakeRuntime

COOKED = outcome("cooked", {"dumpling_cooked": True})
COLD = outcome("cold", {}, failure=True)
BOIL, STEAM = skill("boil", COOKED, COLD), skill("steam", COOKED, COLD)
KITCHEN = replace(module("kitchen", (BOIL, STEAM)), capabilities={"cooking": ("boil", "steam")})
NOT_BARRED: frozenset[str] = frozenset()
BOIL_STEP = PlanStep("kitchen", "boil", retry=2)
AS_CAPABILITY = replace(BOIL_STEP, skill="cooking")


def found(*steps: PlanStep, barred: frozenset[str] = NOT_BARRED, **modules: Ecm) -> dict[int, PlanStep]:
    return capability_steps(TaskGraph(steps), modules or {"kitchen": KITCHEN}, barred, "kitchen")


def test_a_step_of_one_of_several_providers_names_the_capability_and_keeps_its_tries() -> None:
    assert found(BOIL_STEP) == {0: AS_CAPABILITY}


@pytest.mark.parametrize(
    "step",
    [
        replace(BOIL_STEP, id="first"),
        replace(BOIL_STEP, inputs={"force": 0.5}),
        PlanStep("kitchen", "freeze"),
        PlanStep("cellar", "boil"),
        AS_CAPABILITY,
    ],
)
def test_a_step_that_only_its_skill_can_do_stays(step: PlanStep) -> None:
    assert found(step) == {}


def test_a_provider_that_needs_an_input_cannot_take_the_place_of_another() -> None:
    needed = {"force": replace(given_input("force", None, (Fraction(0), Fraction(1))), default_value=None)}
    fussy = replace(KITCHEN, skills={"boil": BOIL, "steam": skill("steam", COOKED, inputs=needed)})
    assert found(BOIL_STEP, kitchen=fussy) == {}
    assert found(BOIL_STEP, kitchen=replace(fussy, skills={"boil": BOIL, "steam": STEAM})) != {}


def test_a_capability_of_which_a_skill_is_prohibited_or_that_has_one_provider_is_not_named() -> None:
    assert found(BOIL_STEP, barred=frozenset({"kitchen.steam"})) == {}
    assert found(BOIL_STEP, kitchen=replace(KITCHEN, capabilities={"cooking": ("boil",)})) == {}


def test_steps_are_replaced_in_their_places_also_in_branches() -> None:
    fork = If(term("wrapper_aligned"), "wrapper_aligned", BOIL_STEP, AS_CAPABILITY, SPAN)
    graph = TaskGraph((BOIL_STEP, fork), "a remark")
    freer = with_capabilities(graph, {1: AS_CAPABILITY})
    assert list(steps_of(freer.body)) == [BOIL_STEP, AS_CAPABILITY, AS_CAPABILITY]
    assert freer.remark == "a remark"


def test_of_several_replacements_those_are_taken_with_which_the_plan_leads_to_the_goal() -> None:
    graph = TaskGraph((BOIL_STEP, BOIL_STEP, BOIL_STEP))
    every = dict.fromkeys(range(3), AS_CAPABILITY)
    assert accepted_places(graph, every, lambda one: True) == [0, 1, 2]
    assert accepted_places(graph, every, lambda one: one.steps[1] == BOIL_STEP) == [0, 2]
    assert accepted_places(graph, every, lambda one: one.steps == graph.steps) == []


class NamesSkills:
    """A planner that names a skill where a capability would do."""

    name = "names skills"

    def plan(self, routed: RoutedTask, world: WorldModel, modules: Mapping[str, Ecm]) -> TaskGraph:
        wrap = () if world.predicates["dumpling_wrapped"] else ("prepare", "recover", "wrap")
        return TaskGraph(tuple(PlanStep("dumpling", one) for one in (*wrap, "boil")))


def with_steam(*outcomes: Outcome) -> Ecm:
    steam = skill("steam", *outcomes, precondition="dumpling_wrapped")
    skills = {
        **DUMPLING.skills,
        "boil": replace(DUMPLING.skills["boil"], outcomes={"cooked": COOKED, "cold": COLD}),
    }
    return replace(DUMPLING, skills={**skills, "steam": steam}, capabilities={"cooking": ("boil", "steam")})


def cook(folder: Path, ecm: Ecm, runs: int) -> tuple[list[str], list[dict[str, Any]], list[list[str]]]:
    """Cook several dumplings; boiling leaves them cold. Returns the first try of each, choices and plans."""
    first, choices, plans = [], [], []
    for _ in range(runs):
        runtime = FakeRuntime(
            {"dumpling": ecm}, chance=lambda name, listed: "cold" if name == "boil" else listed[0]
        )
        with start_agent(folder, "chef", runtime, NamesSkills(), within=30.0) as agent:
            agent.run("Make dumplings!")
        first.append(next(one for one in runtime.submitted if one in ("boil", "steam")))
        choices += [details for kind, details in runtime.notes if kind == "provider-selected"]
        plans += [details["steps"] for kind, details in runtime.notes if kind == "plan-accepted"]
    return first, choices, plans


def test_a_planner_that_names_a_skill_leaves_the_choice_to_the_agents_memory(tmp_path: Path) -> None:
    first, choices, plans = cook(tmp_path, with_steam(COOKED, COLD), 6)
    assert first[-3:] == ["steam"] * 3
    assert plans[0][-1] == "dumpling.cooking"
    assert choices[-1]["reason"] == "least expected time until success"


def test_a_provider_that_may_lose_the_goal_is_not_offered(tmp_path: Path) -> None:
    spoilt = outcome("spoilt", {"dumpling_wrapped": False, "wrapper_aligned": False}, failure=True)
    lost = replace(with_steam(COOKED, spoilt), tasks={"make_dumplings": MAKE_DUMPLINGS})
    skills = {name: one for name, one in lost.skills.items() if name not in ("recover", "wrap")}
    wrapped = replace(lost, skills=skills)
    runtime = FakeRuntime({"dumpling": wrapped})
    runtime.state |= dict.fromkeys(("dumpling_wrapped", "wrapper_aligned"), True)
    with start_agent(tmp_path, "chef", runtime, NamesSkills(), within=30.0) as agent:
        assert agent.run("Make dumplings!").reached
    assert runtime.submitted == ["boil"]


def test_inputs_that_all_providers_have_are_kept() -> None:
    skills = {one: skill(one, COOKED, inputs={"force": FORCE}) for one in ("boil", "steam")}
    step = replace(BOIL_STEP, inputs={"force": 0.25})
    assert found(step, kitchen=replace(KITCHEN, skills=skills)) == {0: replace(step, skill="cooking")}
