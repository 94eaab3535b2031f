"""A strategy keeps the goal reachable whatever happens, or there is none."""

from __future__ import annotations

from dataclasses import replace

import pytest

from aeros.spec.closed_loop.invocation import State
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.model.ecm import ActionCondition, TaskInvariant
from aeros.spec.planning.domain import PlanningDomain, domain_for
from aeros.spec.planning.search_result import AvoidSet, PlanPath
from aeros.spec.planning.shortest import shortest_plan
from aeros.spec.planning.strong_cyclic import StrongCyclicStrategy
from tests.unit.agent.dumplings import SPAN, module, outcome, site, skill, term
from tests.unit.spec.planning.kitchen import BOIL, UNTOUCHED, WRAP, chain, domain_of, reason, where


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


TORN = skill(
    "wrap",
    outcome("wrapped", {"dumpling_wrapped": True}),
    outcome("torn", {"wrapper_aligned": False}, failure=True),
    precondition="wrapper_aligned",
)
ALIGN = skill("align", outcome("aligned", {"wrapper_aligned": True}))


def solved(domain: PlanningDomain, start: State) -> StrongCyclicStrategy:
    strategy = StrongCyclicStrategy(domain)
    assert strategy.solves(start)
    return strategy


def test_a_failure_is_provided_for_by_a_choice_in_the_state_it_leads_to() -> None:
    domain = domain_of(TORN, ALIGN, BOIL)
    assert domain.names == ("dumpling_cooked", "dumpling_wrapped", "wrapper_aligned")
    strategy = solved(domain, (False, False, True))
    assert {state: choice.name for state, choice in strategy.chosen.items()} == {
        (False, False, True): "kitchen.wrap",
        (False, False, False): "kitchen.align",
        (False, True, True): "kitchen.boil",
    }
    assert strategy.dead_ends == []
    assert strategy.distance_to_goal((False, False, False)) == 3
    assert strategy.distance_to_goal((True, False, False)) == 0
    assert strategy.reachable_from((False, False, True)) == [
        (False, False, True),
        (False, True, True),
        (False, False, False),
        (True, True, True),
    ]


def test_a_start_at_the_goal_needs_no_choice() -> None:
    strategy = solved(domain_of(BOIL), (True,))
    assert (strategy.chosen, strategy.reachable_from((True,))) == ({}, [(True,)])


def test_each_start_is_searched_once_and_what_was_found_for_one_serves_another() -> None:
    asked: list[State] = []

    def noted(domain: PlanningDomain, start: State, avoided: AvoidSet) -> PlanPath | None:
        asked.append(start)
        return shortest_plan(domain, start, avoided)

    strategy = StrongCyclicStrategy(chain(3), noted)
    assert strategy.solves((False, False, False))
    count = len(asked)
    assert strategy.solves((False, False, False))
    assert strategy.solves((True, True, False))
    assert len(asked) == count


def test_a_dead_end_is_reported_once_with_the_way_to_it() -> None:
    burn = skill(
        "boil",
        outcome("cooked", {"dumpling_cooked": True}),
        outcome("torn", {"wrapper_aligned": True}, failure=True),
        precondition="not wrapper_aligned",
    )
    strategy = StrongCyclicStrategy(domain_of(burn))
    start = (False, False)
    assert not strategy.solves(start)
    assert not strategy.solves(start)
    assert [(one.state, one.trace) for one in strategy.dead_ends] == [
        ((False, True), ("kitchen.boil → torn",)),
        (start, ()),
    ]
    assert strategy.chosen == {}
    assert (
        strategy.dead_ends[1].reason
        == "every path from there may lead to a state from which the goal is out of reach"
    )


def test_a_state_that_breaks_an_invariant_is_a_dead_end() -> None:
    kept = TaskInvariant("kept", term("not dumpling_wrapped"), "", SPAN)
    modules = {"kitchen": module("kitchen", (BOIL, replace(WRAP, precondition=None)))}
    domain = domain_for(modules, site(), UNTOUCHED, term("dumpling_cooked"), (kept,))
    strategy = StrongCyclicStrategy(domain)
    assert not strategy.solves((True, True))
    assert strategy.dead_ends[0].reason == "the invariant `kept` does not hold there"
    assert not strategy.solves((False, False))
    assert strategy.solves((True, False))


def test_a_strategy_that_leads_nowhere_is_an_error_of_our_own() -> None:
    idle = skill("boil", outcome("cooked", {"dumpling_cooked": True}), outcome("cold", {}, failure=True))
    domain = domain_of(idle)
    strategy = solved(domain, (False,))
    domain._after[(id(strategy.chosen[(False,)]), (False,))] = []
    with pytest.raises(InternalError, match="does not lead to the goal"):
        strategy.distance_to_goal((False,))
