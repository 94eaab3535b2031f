"""Planning domains of the dumpling kitchen and of a panel of switches."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from typing import Any

from aeros.agent.planning.strong_cyclic import explain_no_plan
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL
from aeros.spec.model.ecm import ActionCondition, Skill
from aeros.spec.model.variables import Declared
from aeros.spec.planning.domain import GroundSkill, PlanningDomain, domain_for
from aeros.spec.planning.strong_cyclic import StrongCyclicStrategy
from tests.unit.agent.dumplings import PREDICATES, SPAN, module, outcome, site, skill, term

UNTOUCHED = dict.fromkeys(PREDICATES, False)


def domain_of(
    *skills: Skill, goal: str = "dumpling_cooked", known: Mapping[str, Any] = UNTOUCHED
) -> PlanningDomain:
    return domain_for({"kitchen": module("kitchen", skills)}, site(), known, term(goal))


def reason(domain: PlanningDomain, known: Mapping[str, Any] = UNTOUCHED) -> str:
    strategy = StrongCyclicStrategy(domain)
    assert not strategy.solves(domain.state(known))
    return explain_no_plan(strategy)


def where(one: Skill, condition: t.Term) -> Skill:
    """The skill, which starts where `condition` holds."""
    return replace(one, precondition=ActionCondition(condition, "", SPAN))


BOIL = skill("boil", outcome("cooked", {"dumpling_cooked": True}), precondition="dumpling_wrapped")
WRAP = skill("wrap", outcome("wrapped", {"dumpling_wrapped": True}), precondition="dough_on_workspace")
TIDY = skill("tidy", outcome("tidied", {"filling_on_workspace": False}))


def chain(length: int) -> PlanningDomain:
    """As many switches, each of which needs the one before it."""
    names = [f"switch_{at}" for at in range(length)]
    variables = {name: t.Variable(name, BOOL, t.VariableRole.STATE) for name in names}
    skills = []
    for at, name in enumerate(names):
        made = skill(f"press_{at}", outcome("on", {name: True}))
        needed: t.Term = variables[names[at - 1]] if at else t.TRUE
        skills.append(where(made, needed))
    state = {name: Declared(one, SPAN, max_age=Fraction(5)) for name, one in variables.items()}
    panel = replace(site(), state=state)
    modules = {"panel": module("panel", tuple(skills))}
    return domain_for(modules, panel, dict.fromkeys(names, False), variables[names[-1]])


def choice_of(domain: PlanningDomain, name: str) -> GroundSkill:
    """The choice of a skill of the kitchen."""
    (found,) = (one for one in domain.choices if one.label == f"kitchen.{name}")
    return found
