"""Exported PDDL, read by a small separate interpreter: its shortest plans are as short as ours."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import replace
from typing import Any

from hypothesis import given

from aeros.agent.planning.pddl import OptimisticPlanFinder
from aeros.spec.planning.pddl import write_pddl
from aeros.spec.planning.plan_check import find_step_problems
from aeros.spec.planning.search_result import AvoidSet
from aeros.spec.planning.shortest import breadth_first_plan
from aeros.spec.planning.strong_cyclic import StrongCyclicStrategy
from tests.differential.planning.planning_problems import Enumeration, Problem, problems
from tests.differential.planning.test_planning import domain_of
from tests.hypothesis_profiles import examples
from tests.property.mix import Mix

Facts = frozenset[str]


def read(text: str) -> Any:
    """S-expressions as nested lists."""
    stack: list[list[Any]] = [[]]
    for word in re.findall(r"[()]|[^\s()]+", text):
        if word == "(":
            stack.append([])
        elif word == ")":
            done = stack.pop()
            stack[-1].append(done)
        else:
            stack[-1].append(word)
    ((whole,),) = stack
    return whole


def holds(formula: Any, facts: Facts) -> bool:
    match formula:
        case ["and", *parts]:
            return all(holds(one, facts) for one in parts)
        case ["or", *parts]:
            return any(holds(one, facts) for one in parts)
        case ["not", part]:
            return not holds(part, facts)
        case [atom]:
            return atom in facts
    raise AssertionError(formula)


def after(effect: Any, facts: Facts) -> Facts:
    parts = effect[1:] if effect[0] == "and" else [effect]
    removed = {one[1][0] for one in parts if one[0] == "not"}
    return (facts - removed) | {one[0] for one in parts if one[0] != "not"}


def shortest(domain_text: str, problem_text: str) -> list[str] | None:
    """Breadth first through what the two files say."""
    actions = [part for part in read(domain_text) if part[0] == ":action"]
    stated = {part[0]: part[1:] for part in read(problem_text)[1:]}
    start: Facts = frozenset(atom for (atom,) in stated[":init"])
    (goal,) = stated[":goal"]
    ways: dict[Facts, list[str]] = {start: []}
    for facts, way in ((one, ways[one]) for one in iter_growing(ways)):
        if holds(goal, facts):
            return way
        for action in actions:
            if holds(action[5], facts):
                ways.setdefault(after(action[7], facts), [*way, action[1]])
    return None


def iter_growing(ways: dict[Facts, list[str]]) -> Any:
    """The keys in order, those that are added on the way too."""
    at = 0
    while at < len(ways):
        yield list(ways)[at]
        at += 1


def test_classical_plans_of_the_export_are_as_short_and_are_judged() -> None:
    found = Counter[bool]()

    @examples(150)
    @given(problems())
    def law(drawn: Problem) -> None:
        problem = replace(drawn, invariants=())
        domain = domain_of(problem)
        start = domain.state(problem.start)
        plan = shortest(*write_pddl(domain, start))
        ours = breadth_first_plan(domain, start, AvoidSet(), 10_000)
        assert (plan is None) is (ours is None)
        found[plan is None] += 1
        if plan is not None and ours is not None:
            assert len(plan) == len(ours)
            problems = find_step_problems(StrongCyclicStrategy(domain), start, plan)
            assert not any("no such skill" in text for text in problems)

    law()
    assert min(found.values()) > 15


class Interpreter:
    """A classical planner: the interpreter above."""

    def solve(self, domain: str, problem: str) -> list[str] | None:
        return shortest(domain, problem)


def test_with_a_classical_planner_a_strategy_is_found_exactly_where_there_is_one() -> None:
    seen = Mix()

    @examples(150)
    @given(problems())
    def law(problem: Problem) -> None:
        domain, every = domain_of(problem), Enumeration(problem)
        strategy, start = (
            StrongCyclicStrategy(domain, OptimisticPlanFinder(Interpreter())),
            domain.state(problem.start),
        )
        seen.compare("strategy", proved=strategy.solves(start), expected=every.start in every.hopeful)
        if every.start in every.hopeful:
            hopeful = {domain.state(dict(state)) for state in every.hopeful}
            assert set(strategy.reachable_from(start)) <= hopeful

    law()
    seen.assert_both("strategy", at_least=15)
