"""Planning without rules: a plan where every outcome can be recovered from, and otherwise a reason."""

from __future__ import annotations

import pytest

from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.smt import SmtPlanner
from aeros.agent.planning.strong_cyclic import NoPlanError
from aeros.agent.planning.task_graph import TaskGraph
from aeros.agent.world.world import WorldModel
from aeros.spec.model.ecm import Skill
from tests.unit.agent.dumplings import MAKE_DUMPLINGS, PREDICATES, SKILLS, module, outcome, site, skill

SPILLED = outcome("spilled", {"dumpling_wrapped": False, "wrapper_aligned": False}, failure=True)


def planned(*skills: Skill) -> TaskGraph:
    world = WorldModel(0.0, dict.fromkeys(PREDICATES, False), {}, {})
    routed = RoutedTask("dumpling", MAKE_DUMPLINGS)
    return SmtPlanner(site()).plan(routed, world, {"dumpling": module("dumpling", skills)})


def test_a_plan_follows_the_declarations_of_skills_and_no_rules() -> None:
    assert {step.skill for step in planned(*SKILLS).steps} == {"prepare", "recover", "wrap", "boil"}


def test_an_outcome_that_nothing_recovers_from_is_named() -> None:
    prepare, _, _, boil = SKILLS
    wrap = skill(
        "wrap", outcome("wrapped", {"dumpling_wrapped": True}), SPILLED, precondition="not wrapper_aligned"
    )
    broken = skill("wrap", outcome("wrapped", {"dumpling_wrapped": True}), precondition="wrapper_aligned")
    assert planned(prepare, wrap, boil).steps
    with pytest.raises(NoPlanError, match=r"^no plan reaches the goal: "):
        planned(prepare, broken, boil)
