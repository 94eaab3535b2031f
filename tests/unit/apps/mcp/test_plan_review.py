"""Plans of clients: the site's policy first, then form, then the check of every outcome."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import PlanStep, TaskGraph
from aeros.agent.world.world import world_from_readings
from aeros.apps.goal import parse_goal
from aeros.apps.mcp.plan_review import ClientPlan, ClientPlanChecker
from aeros.apps.mcp.tool_arguments import ProposedStep
from aeros.runtime.ports import Reading
from aeros.spec.model.ecm import ActionCondition, Ecm
from aeros.spec.model.policy import McpPolicy
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared
from aeros.spec.planning.search_result import PlanUndecidedError
from tests.unit.agent.dumplings import (
    DUMPLING,
    FORCE,
    MAKE_DUMPLINGS,
    PREDICATES,
    SPAN,
    module,
    outcome,
    site,
    skill,
    state,
    term,
)

GOAL = ActionCondition(term("dumpling_cooked"), "dumpling_cooked", SPAN)
WHOLE = ("dumpling.prepare", "dumpling.recover", "dumpling.wrap", "dumpling.boil")


ROUTED = RoutedTask("dumpling", MAKE_DUMPLINGS)


def steps(*names: str) -> tuple[ProposedStep, ...]:
    return tuple(ProposedStep(name, {}) for name in names)


def problems(
    *proposed: ProposedStep, policy: McpPolicy | None = None, ecm: Ecm = DUMPLING, **true: bool
) -> list[str]:
    at: Site = replace(site(), mcp=policy or McpPolicy())
    values = dict.fromkeys(PREDICATES, False) | true
    readings = {name: Reading(value, 0.0) for name, value in values.items()}
    world = world_from_readings(at.state, readings, 0.0)
    checker = ClientPlanChecker(lambda: at)
    return checker.problems(ClientPlan(proposed, GOAL, ROUTED), ROUTED, world, {"dumpling": ecm})


def test_the_graph_has_the_steps_in_order_without_retries() -> None:
    plan = ClientPlan((ProposedStep("m.one", {"force": 0.5}), ProposedStep("m.two.three", {})), GOAL, ROUTED)
    assert plan.graph == TaskGraph((PlanStep("m", "one", {"force": 0.5}), PlanStep("m", "two.three", {})))


def test_a_plan_that_reaches_the_goal_is_accepted() -> None:
    assert problems(*steps(*WHOLE)) == []
    assert problems(*steps(*WHOLE[3:]), dumpling_wrapped=True) == []


def test_a_plan_that_cannot_start_or_ends_too_early_is_not() -> None:
    assert "its precondition" in problems(*steps("dumpling.wrap", "dumpling.boil"))[0]
    assert "it ends, and the goal does not hold" in problems(*steps(*WHOLE[:3]))[0]


def test_the_policy_names_the_skills_and_the_number_of_steps() -> None:
    allowed = McpPolicy(max_steps=2, skills=frozenset({"dumpling.prepare"}))
    assert problems(*steps(*WHOLE), policy=allowed) == ["the plan has 4 steps; this site allows 2"]
    assert problems(*steps(*WHOLE[:2]), policy=allowed) == [
        "step 2: this site's `policy.mcp.skills` does not have `dumpling.recover`"
    ]
    assert problems(*steps(*WHOLE), policy=McpPolicy(max_steps=4, skills=frozenset(WHOLE))) == []
    assert problems(*steps(WHOLE[0]), policy=McpPolicy(skills=frozenset())) != []


@pytest.mark.parametrize(
    ("proposed", "problem"),
    [
        (
            ProposedStep("dumpling.boil", {"force": 0.5}),
            "step 1: omit `force`; plans are checked with its default",
        ),
        (ProposedStep("dumpling.boil", {"salt": 0.5}), "`salt` is not an input of it"),
        (ProposedStep("dumpling.fly", {}), "`dumpling` has no skill `fly`"),
        (ProposedStep("kitchen.boil", {"force": 1.0}), "no active module is named `kitchen`"),
        (ProposedStep("boil", {}), "no active module is named `boil`"),
    ],
)
def test_a_step_of_another_form_is_refused(proposed: ProposedStep, problem: str) -> None:
    (found,) = problems(proposed)
    assert problem in found


def test_a_check_that_is_given_up_accepts_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    def give_up(*_: object) -> list[str]:
        raise PlanUndecidedError("too many states")

    monkeypatch.setattr("aeros.apps.mcp.plan_review.find_step_problems", give_up)
    assert problems(*steps(*WHOLE)) == ["rejected: acceptance could not be decided: too many states"]


def test_an_empty_plan_is_refused() -> None:
    assert problems() == ["the plan is empty, but the goal is not reached"]


def _with_lid() -> Ecm:
    """Boiling cooks only under a lid, which an input without default says."""
    lid = Declared(replace(state("lid").variable, name="inputs.lid", role=FORCE.variable.role), SPAN)
    boil = skill("boil", outcome("cooked", {"dumpling_cooked": True}), inputs={"lid": lid})
    return module("dumpling", (*DUMPLING.skills.values(), boil), MAKE_DUMPLINGS)


def test_an_input_without_default_is_checked_with_the_value_given() -> None:
    def boil(**inputs: Any) -> list[str]:
        return problems(ProposedStep("dumpling.boil", inputs), ecm=_with_lid())

    assert boil(lid=True) == []
    assert boil(lid=False) == []
    assert boil() != []
    assert boil(lid="on") != []


def test_a_skill_that_the_goal_does_not_need_may_be_in_a_plan() -> None:
    wave = skill("wave", outcome("waved", {}))
    ecm = module("dumpling", (*DUMPLING.skills.values(), wave), MAKE_DUMPLINGS)
    assert problems(*steps("dumpling.wave", *WHOLE), ecm=ecm) == []


def test_the_goal_of_the_plan_counts_and_not_the_tasks() -> None:
    goal = parse_goal("dough_on_workspace", site())
    at = site()
    world = world_from_readings(at.state, {name: Reading(False, 0.0) for name in PREDICATES}, 0.0)
    found = ClientPlanChecker(lambda: at).problems(
        ClientPlan(steps("dumpling.prepare"), goal, ROUTED),
        ROUTED,
        world,
        {"dumpling": DUMPLING},
    )
    assert found == []
