"""Strategies as task graphs: steps, retries with recoveries, and an `if` where successes differ."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from aeros.agent.planning.strategy_to_graph import strategy_to_graph
from aeros.agent.planning.task_graph import PlanStep, TaskGraph
from aeros.spec.expr.parser import parse
from aeros.spec.expr.scope import Scope
from aeros.spec.expr.typecheck.check import check
from aeros.spec.expr.types import BOOL
from aeros.spec.model.ecm import ActionCondition, Outcome, Skill
from aeros.spec.model.step_graph import If, Seq
from aeros.spec.model.variables import Declared
from aeros.spec.planning.domain import domain_for
from aeros.spec.planning.strong_cyclic import StrongCyclicStrategy
from tests.unit.agent.dumplings import (
    FORCE,
    PREDICATES,
    SKILLS,
    SPAN,
    module,
    outcome,
    site,
    skill,
    state,
    term,
)

DOUGH, FILLING, ALIGNED, WRAPPED, COOKED = PREDICATES
NOTHING = {**dict.fromkeys(PREDICATES, False), "area": "table"}


def graph(*skills: Skill, retries: int = 3, goal: str = COOKED, **start: Any) -> TaskGraph:
    known = {**NOTHING, **start}
    modules = {"m": module("m", skills)}
    strategy = StrongCyclicStrategy(domain_for(modules, site(), known, term(goal)))
    begin = strategy.domain.state(known)
    assert strategy.solves(begin)
    return strategy_to_graph(strategy, begin, retries)


def plan_lines(*skills: Skill, retries: int = 3, goal: str = COOKED, **start: Any) -> list[str]:
    return [str(part) for part in graph(*skills, retries=retries, goal=goal, **start).parts]


def brings(name: str, effect: str, *more: Outcome, needs: str | None = None) -> Skill:
    return skill(name, outcome("done", {effect: True}), *more, precondition=needs)


FAILS = outcome("fails", {}, failure=True)


def test_where_the_goal_holds_nothing_is_to_be_done() -> None:
    assert graph(*SKILLS, dumpling_cooked=True) == TaskGraph(())


def test_failures_that_the_strategy_covers_become_retries_and_a_recovery() -> None:
    assert plan_lines(*SKILLS) == [
        "m.prepare",
        "m.recover",
        "m.wrap (retry 3, between_tries recover)",
        "m.boil (retry 3)",
    ]


def test_no_step_is_retried_more_often_than_is_allowed() -> None:
    assert plan_lines(*SKILLS, retries=1)[2] == "m.wrap (retry 1, between_tries recover)"
    assert plan_lines(*SKILLS, retries=0) == ["m.prepare", "m.recover", "m.wrap", "m.boil"]


def test_a_step_that_failure_keeps_from_starting_is_tried_again_after_its_recovery() -> None:
    spills = outcome("spills", {DOUGH: False}, failure=True)
    knead, cook = brings("knead", DOUGH), brings("cook", COOKED, spills, needs=DOUGH)
    (first, then) = graph(knead, cook).steps
    assert first == PlanStep("m", "knead", {}, 0)
    assert then == PlanStep("m", "cook", {}, 3, PlanStep("m", "knead"))


def test_of_several_reactions_to_failure_none_is_the_recovery() -> None:
    loses = [outcome(f"loses_{name}", {name: False}, failure=True) for name in (DOUGH, FILLING)]
    skills = (
        brings("knead", DOUGH),
        brings("mince", FILLING),
        brings("cook", COOKED, *loses, needs=f"{DOUGH} and {FILLING}"),
    )
    assert graph(*skills).steps[-1] == PlanStep("m", "cook", {}, 0, None)


def test_a_recovery_never_waits_for_itself() -> None:
    first = brings("first", DOUGH, outcome("undone", {FILLING: False}, failure=True), needs=FILLING)
    second = brings("second", FILLING, outcome("undone", {DOUGH: False}, failure=True))
    last = brings("last", COOKED, needs=f"{DOUGH} and {FILLING}")
    found = {
        step.skill: None if step.between_tries is None else step.between_tries.skill
        for step in graph(first, second, last).steps
    }
    assert found == {"second": None, "first": "second", "last": None}


TWO_WAYS = skill("look", outcome("raw", {DOUGH: True, ALIGNED: True}), outcome("ripe", {DOUGH: True}))


def test_two_successes_are_followed_by_an_if_on_a_value_that_distinguishes_them() -> None:
    skills = (TWO_WAYS, brings("align", ALIGNED, needs=DOUGH), brings("cook", COOKED, needs=ALIGNED))
    look, fork, cook = graph(*skills).parts
    assert isinstance(fork, If)
    assert [str(look), str(fork), str(cook)] == [
        "m.look",
        "(if not wrapper_aligned then (m.align) else nothing)",
        "m.cook",
    ]
    assert fork.condition == term("not wrapper_aligned")


def test_two_successes_after_which_the_same_is_to_be_done_need_no_if() -> None:
    peek = skill("peek", outcome("left", {DOUGH: True}), outcome("right", {DOUGH: True, "area": "pot"}))
    cook = brings("cook", COOKED, needs=f"{DOUGH} and not (area == pot and {WRAPPED})")
    assert plan_lines(peek, cook) == ["m.peek", "m.cook"]


def test_three_successes_with_three_ways_are_distinguished_one_by_one() -> None:
    deal = skill(
        "deal",
        outcome("one", {DOUGH: True}),
        outcome("two", {FILLING: True}),
        outcome("both", {DOUGH: True, FILLING: True}),
    )
    skills = (
        deal,
        brings("fill", FILLING, needs=f"{DOUGH} and not {FILLING}"),
        brings("knead", DOUGH, needs=f"{FILLING} and not {DOUGH}"),
        brings("cook", COOKED, needs=f"{DOUGH} and {FILLING}"),
    )
    _, fork, last = graph(*skills).parts
    assert str(last) == "m.cook"
    assert isinstance(fork, If)
    assert isinstance(fork.otherwise, If)
    ways = {fork.text: str(fork.then), fork.otherwise.text: str(fork.otherwise.then)}
    assert ways == {
        "not filling_on_workspace": "(m.fill)",
        "not dough_on_workspace": "(m.knead)",
    }
    assert fork.otherwise.otherwise == Seq(())


def test_a_way_that_comes_back_to_where_it_was_ends_there() -> None:
    toss = skill("toss", outcome("heads", {DOUGH: True}), outcome("tails", {}))
    cook = brings("cook", COOKED, needs=DOUGH)
    toss_step, fork = graph(toss, cook).parts
    assert str(toss_step) == "m.toss"
    assert str(fork) == "(if dough_on_workspace then (m.cook) else nothing)"


def test_an_input_without_default_has_the_value_that_the_strategy_chose() -> None:
    is_hot = Declared(replace(state("hot").variable, name="inputs.hot", role=FORCE.variable.role), SPAN)
    scope = Scope({}, inputs={"hot": is_hot.variable}, enums={})
    hot_only = ActionCondition(check(parse("inputs.hot"), scope, BOOL), "inputs.hot", SPAN)
    cook = replace(brings("cook", COOKED), inputs={"hot": is_hot}, precondition=hot_only)
    assert graph(cook).steps == (PlanStep("m", "cook", {"hot": True}),)


def test_a_step_that_can_only_fail_the_same_way_again_is_retried_alone() -> None:
    assert graph(brings("cook", COOKED, FAILS)).steps == (PlanStep("m", "cook", {}, 3),)


def test_no_branch_is_nested_deeper_than_the_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    # The first `if` is of level 1, and the second would be in it; single steps count as no level.
    monkeypatch.setattr("aeros.agent.planning.strategy_to_graph._MAX_DEPTH", 1)
    again = skill(
        "again",
        outcome("big", {FILLING: True}),
        outcome("small", {FILLING: True, WRAPPED: True}),
        precondition=f"{DOUGH} and not {FILLING}",
    )
    skills = (
        brings("start", DOUGH),
        again,
        skill(
            "align",
            outcome("here", {ALIGNED: True}),
            outcome("there", {ALIGNED: True, "area": "pot"}),
            precondition=FILLING,
        ),
        brings("cook", COOKED, needs=f"{ALIGNED} or {WRAPPED}"),
    )
    assert plan_lines(*skills) == [
        "m.start",
        "m.again",
        "(if not dumpling_wrapped then (m.align) else (m.cook))",
    ]


def test_a_graph_has_no_more_steps_than_the_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("aeros.agent.planning.strategy_to_graph._MAX_STEPS", 2)
    assert plan_lines(*SKILLS) == ["m.prepare", "m.recover"]


def test_a_success_that_no_single_value_distinguishes_is_recognised_by_several() -> None:
    deal = skill(
        "deal",
        outcome("half", {ALIGNED: True, DOUGH: True}),
        outcome("none", {ALIGNED: True}),
        outcome("all", {ALIGNED: True, DOUGH: True, FILLING: True}),
        precondition=f"not {ALIGNED}",
    )
    skills = (
        deal,
        brings("fetch", WRAPPED, needs=f"{DOUGH} and not {FILLING}"),
        brings("fill", FILLING, needs=f"{WRAPPED}"),
        skill(
            "restock",
            outcome("done", {DOUGH: True, FILLING: True}),
            precondition=f"not {DOUGH} and {ALIGNED}",
        ),
        brings("cook", COOKED, needs=f"{DOUGH} and {FILLING} and {ALIGNED}"),
    )
    _, fork, _ = graph(*skills).parts
    assert str(fork) == (
        "(if dough_on_workspace and (not filling_on_workspace) then (m.fetch → m.fill)"
        " else (if not dough_on_workspace then (m.restock) else nothing))"
    )


def test_successes_with_the_same_way_share_a_branch() -> None:
    deal = skill(
        "deal",
        outcome("dough", {DOUGH: True}),
        outcome("filling", {FILLING: True}),
        outcome("both", {DOUGH: True, FILLING: True}),
        precondition=f"not {DOUGH} and not {FILLING}",
    )
    fix = skill(
        "fix",
        outcome("done", {DOUGH: True, FILLING: True}),
        precondition=f"{DOUGH} and not {FILLING} or {FILLING} and not {DOUGH}",
    )
    _, fork, _ = graph(deal, fix, brings("cook", COOKED, needs=f"{DOUGH} and {FILLING}")).parts
    assert str(fork) == (
        "(if (not filling_on_workspace) or (not dough_on_workspace) then (m.fix) else nothing)"
    )
