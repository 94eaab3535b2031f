"""What a planning domain has in it, and what is said where there is no plan."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from typing import Any

import pytest

from aeros.agent.planning.strong_cyclic import explain_no_plan
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL, EnumType
from aeros.spec.model.ecm import ActionCondition, Ecm, Skill
from aeros.spec.model.policy import OperatorOverride
from aeros.spec.model.rules import Rule
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared
from aeros.spec.planning.bounded import bounded_plan
from aeros.spec.planning.domain import PlanningDomain, domain_for
from aeros.spec.planning.search_result import AvoidSet, PlanUndecidedError
from aeros.spec.planning.shortest import breadth_first_plan, shortest_plan
from aeros.spec.planning.strong_cyclic import StrongCyclicStrategy
from tests.differential.reference_cases import reference
from tests.unit.agent.dumplings import PREDICATES, SPAN, given_input, module, outcome, site, skill, term

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


def test_only_what_bears_on_the_goal_is_in_the_domain() -> None:
    domain = domain_of(BOIL, WRAP, TIDY)
    assert domain.names == ("dumpling_cooked", "dumpling_wrapped")
    assert [one.name for one in domain.choices] == ["kitchen.boil", "kitchen.wrap"]


def test_what_no_skill_brings_about_is_followed_from_the_goal_backwards() -> None:
    assert reason(domain_of(BOIL, WRAP)) == (
        "no plan reaches the goal: "
        "the goal needs `dumpling_cooked`, which only `kitchen.boil` could make true; "
        "`kitchen.boil` needs `dumpling_wrapped`, which only `kitchen.wrap` could make true; "
        "`kitchen.wrap` needs `dough_on_workspace`, which does not hold now, and no skill changes it"
    )


def test_what_is_not_measured_satisfies_nothing() -> None:
    known = {name: value for name, value in UNTOUCHED.items() if name != "dough_on_workspace"}
    said = reason(domain_of(BOIL, WRAP, known=known), known)
    assert said.endswith("`dough_on_workspace`: `dough_on_workspace` is not measured, and no skill sets it")


def test_a_condition_on_measured_numbers_is_as_measured() -> None:
    fill = where(BOIL, term("fill_level > 0.5"))
    full: dict[str, Any] = {**UNTOUCHED, "fill_level": Fraction(6, 10)}
    empty: dict[str, Any] = {**UNTOUCHED, "fill_level": Fraction(4, 10)}
    domain = domain_of(fill, known=full)
    assert StrongCyclicStrategy(domain).solves(domain.state(full))
    said = reason(domain_of(fill, known=empty), empty)
    assert said.endswith("needs `0.5 < fill_level`, which does not hold now, and no skill changes it")


def test_the_outcome_that_leads_astray_is_named_with_what_it_leads_to() -> None:
    burn = skill(
        "boil",
        outcome("cooked", {"dumpling_cooked": True}),
        outcome("torn", {"wrapper_aligned": True}, failure=True),
        precondition="not wrapper_aligned",
    )
    assert reason(domain_of(burn)) == (
        "no plan recovers from every outcome: kitchen.boil → torn leads to dumpling_cooked = false, "
        "wrapper_aligned = true, and there the goal needs `dumpling_cooked`, which only `kitchen.boil` could "
        "make true; `kitchen.boil` needs `not wrapper_aligned`, which no skill makes true"
    )


def test_a_longer_way_is_taken_where_the_shortest_may_lead_astray() -> None:
    risky = skill(
        "risky",
        outcome("cooked", {"dumpling_cooked": True}),
        outcome("torn", {"wrapper_aligned": True}, failure=True),
    )
    safe = where(BOIL, term("dumpling_wrapped and not wrapper_aligned"))
    wrap = replace(WRAP, precondition=None)
    risky = where(risky, term("not wrapper_aligned"))
    domain = domain_of(risky, safe, wrap)
    strategy = StrongCyclicStrategy(domain)
    start = domain.state(UNTOUCHED)
    assert strategy.solves(start)
    assert strategy.distance_to_goal(start) == 2
    assert strategy.chosen[start].name == "kitchen.wrap"


def test_an_input_without_default_has_each_of_few_values_and_else_keeps_the_skill_out() -> None:
    area = EnumType("area", ("table", "pot"))
    put = replace(
        skill("put", outcome("put", {"dumpling_cooked": True}), precondition="dumpling_wrapped"),
        inputs={"at": Declared(t.Variable("inputs.at", area, t.VariableRole.INPUT), SPAN)},
    )
    wanted = t.Compare("==", put.inputs["at"].variable, t.Literal("pot", area))
    put = where(put, wanted)
    domain = domain_of(put)
    strategy = StrongCyclicStrategy(domain)
    assert strategy.solves(domain.state(UNTOUCHED))
    assert strategy.chosen[domain.state(UNTOUCHED)].inputs == {"at": "pot"}
    forced = replace(
        put, inputs={"force": given_input("force", None, (Fraction(0), Fraction(1)))}, precondition=None
    )
    assert domain_of(forced).excluded_skills == {"kitchen.put": "its input `force` has no value"}
    assert "`kitchen.put` is left out: its input `" in reason(domain_of(forced))


def fetching(at: Site, ecm: Ecm, start: Mapping[str, Any], goal: t.Term) -> tuple[bool, str]:
    domain = domain_for({ecm.id: ecm}, at, start, goal)
    strategy = StrongCyclicStrategy(domain)
    solved = strategy.solves(domain.state(start))
    return solved, "" if solved else explain_no_plan(strategy)


def test_no_plan_needs_what_the_site_would_always_deny() -> None:
    case = reference("fetch_object", 3)
    blind = t.Not(case.site.state["object_detected"].variable)
    rule = Rule("blind-grip", "", "", "", {"grip": blind}, {}, SPAN, SPAN)
    assert fetching(case.site, case.ecm, case.start, case.task.goal) == (True, "")
    forbidding = replace(case.site, rules=(*case.site.rules, rule))
    solved, why = fetching(forbidding, case.ecm, case.start, case.task.goal)
    assert not solved
    assert "deny every `grip` of `fetch_object.grasp` where `object_detected`" in why
    blocked = case.site.with_overrides([OperatorOverride("maintenance", "hand is worn", None, None, "grip")])
    solved, why = fetching(blocked, case.ecm, case.start, case.task.goal)
    assert not solved
    assert "`fetch_object.grasp` is left out: the operator's block `maintenance` denies" in why


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


def test_the_solver_takes_over_where_many_states_can_be_reached() -> None:
    domain = chain(12)
    start = (False,) * 12
    enumerated = breadth_first_plan(domain, start, AvoidSet(), 10_000)
    solved = shortest_plan(domain, start, AvoidSet(), few=5)
    assert enumerated is not None
    assert solved is not None
    assert [one.name for _, one in solved] == [one.name for _, one in enumerated]


def test_that_no_plan_was_found_is_not_taken_for_that_there_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("aeros.spec.planning.bounded.MAX_PLAN_LENGTH", 6)
    with pytest.raises(PlanUndecidedError, match="no plan of up to 6 steps was found, and none was proved"):
        bounded_plan(chain(9), (False,) * 9, AvoidSet(), 0)


def test_what_a_broken_hold_condition_leaves_is_provided_for_and_not_counted_on() -> None:
    holding = replace(
        BOIL, precondition=None, hold_condition=ActionCondition(term("dumpling_wrapped"), "", SPAN)
    )
    holding = where(holding, term("dumpling_wrapped"))
    again = skill("wrap", outcome("wrapped", {"dumpling_wrapped": True}))
    domain = domain_of(holding, again)
    boil = next(one for one in domain.choices if one.name == "kitchen.boil")
    start = domain.state(UNTOUCHED | {"dumpling_wrapped": True})
    ended = {(outcome.id, then) for then, outcome, _ in domain.after(boil, start)}
    assert ("unheld", domain.state(UNTOUCHED)) in ended
    assert set(domain.settings["dumpling_wrapped"]) == {False, True}
    assert StrongCyclicStrategy(domain).solves(start)
    # Without a skill that wraps again nothing is set, so the world is taken to bring it back.
    assert StrongCyclicStrategy(domain_of(holding, known=UNTOUCHED | {"dumpling_wrapped": True})).solves(
        domain_of(holding).state(UNTOUCHED)
    )


def test_no_plan_goes_where_a_broken_hold_condition_leaves_no_way_on() -> None:
    once = skill(
        "wrap",
        outcome("wrapped", {"dumpling_wrapped": True, "wrapper_aligned": False}),
        precondition="wrapper_aligned",
    )
    holding = where(
        replace(BOIL, hold_condition=ActionCondition(term("dumpling_wrapped"), "", SPAN)),
        term("dumpling_wrapped"),
    )
    known = UNTOUCHED | {"wrapper_aligned": True}
    domain = domain_of(holding, once, known=known)
    strategy = StrongCyclicStrategy(domain)
    assert not strategy.solves(domain.state(known))
    assert any("kitchen.boil → unheld" in one.trace for one in strategy.dead_ends)
    assert StrongCyclicStrategy(domain_of(BOIL, once, known=known)).solves(domain.state(known))
