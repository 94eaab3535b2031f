"""Plans agree with a search of every state: as short, found wherever there is one, and nowhere else."""

from __future__ import annotations

import json
import random
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from fractions import Fraction
from typing import Any

import pytest
from hypothesis import Phase, given
from hypothesis import strategies as st

from aeros.agent.planning.check_plan import PlanChecker
from aeros.agent.planning.plan_json import parse_strict_json, plan_from_json, plan_to_json
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.smt import SmtPlanner
from aeros.agent.planning.strategy_to_graph import strategy_to_graph
from aeros.agent.planning.task_graph import PlanStep, TaskGraph, verify_plan
from aeros.agent.world.world import WorldModel, world_from_readings
from aeros.spec.closed_loop.invocation import State
from aeros.spec.model.ecm import Ecm, Outcome
from aeros.spec.model.step_graph import If, walk_parts
from aeros.spec.planning.domain import GroundSkill, PlanningDomain, domain_for
from aeros.spec.planning.plan_check import find_step_problems
from aeros.spec.planning.search_result import AvoidSet, PlanPath, PlanUndecidedError
from aeros.spec.planning.shortest import shortest_plan
from aeros.spec.planning.strong_cyclic import StrongCyclicStrategy
from tests.differential.planning.planning_problems import NAMES, Enumeration, Problem, problems
from tests.differential.real_loop import Recording, pursue
from tests.hypothesis_profiles import examples
from tests.property.mix import Mix
from tests.unit.agent.dumplings import module, site, skill, task, term


def domain_of(problem: Problem) -> PlanningDomain:
    modules = {problem.ecm.id: problem.ecm}
    return domain_for(modules, problem.site, problem.start, problem.goal, problem.invariants)


def judge(problem: Problem, strategy: StrongCyclicStrategy, seen: Mix) -> None:
    """A strategy exists exactly where enumeration finds one; then it is closed, and its way as short."""
    domain, every = strategy.domain, Enumeration(problem)
    start = domain.state(problem.start)
    hopeful = every.hopeful
    seen.compare("strategy", proved=strategy.solves(start), expected=every.start in hopeful)
    if every.start not in hopeful:
        assert strategy.dead_ends
        return
    assert strategy.distance_to_goal(start) == every.distances(hopeful)[every.start]
    projected = {domain.state(dict(state)) for state in hopeful}
    for state in strategy.reachable_from(start):
        assert state in projected
        assert strategy.distance_to_goal(state) >= 0


def by_solver(domain: PlanningDomain, start: State, avoided: AvoidSet) -> PlanPath | None:
    """So few states are looked at that Z3 decides most of it."""
    return shortest_plan(domain, start, avoided, few=3)


def test_a_strategy_is_found_exactly_where_there_is_one_and_none_is_shorter() -> None:
    seen = Mix()
    _law(lambda problem: judge(problem, StrongCyclicStrategy(domain_of(problem)), seen), 100)
    seen.assert_both("strategy", at_least=15)


def test_the_solver_finds_plans_as_short_and_reports_undecided_cases() -> None:
    decided = Counter[bool]()

    def compare(problem: Problem) -> None:
        domain = domain_of(problem)
        try:
            judge(problem, StrongCyclicStrategy(domain, by_solver), Mix())
            decided[True] += 1
        except PlanUndecidedError:
            decided[False] += 1

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("aeros.spec.planning.bounded.MAX_PLAN_LENGTH", 8)
        _law(compare, 90)
    assert decided[True] > 40


def test_runs_never_leave_hope_and_every_step_starts_where_it_may() -> None:
    ends = Counter[bool]()

    @examples(165)
    @given(problems(), st.integers(0, 2**32))
    def law(problem: Problem, seed: int) -> None:
        every = Enumeration(problem)
        if every.start not in every.hopeful or every.holds(problem.goal, every.start):
            return
        chance = random.Random(seed)  # noqa: S311 - draws outcomes
        likely = {
            one.id: [outcome.id for outcome in one.outcomes.values() if outcome.probability != 0]
            for one in problem.ecm.skills.values()
        }
        runtime = Recording(
            problem.ecm, problem.site, problem.start, lambda name, _: chance.choice(likely[name])
        )
        pursued = replace(
            task("task", ("word",), "area == pot"), goal=problem.goal, invariants=problem.invariants
        )
        report = pursue(problem.ecm, pursued, runtime, SmtPlanner(problem.site))
        assert {frozenset(state.items()) for state in runtime.states} <= every.hopeful
        unmet = [
            note for kind, note in runtime.notes if kind == "step-not-started" and note["role"] == "step"
        ]
        assert not unmet
        assert "plan-rejected" not in runtime.kinds()
        ends[report.reached] += 1

    law()
    assert ends[True] > 20


class _Careless(PlanningDomain):
    """A twin: nothing ever fails."""

    def after(self, choice: GroundSkill, state: State) -> list[tuple[State, Outcome, Fraction]]:
        return [way for way in super().after(choice, state) if not way[1].failure]


class _Bold(PlanningDomain):
    """A twin: what is unknown is taken to be as it should be."""

    def can_start(self, choice: GroundSkill, state: State) -> bool:
        return choice.condition(state) is not False


class _Ruthless(PlanningDomain):
    """A twin: invariants are for others."""

    def violated_invariant(self, state: State) -> str | None:
        return None


def roundabout(domain: PlanningDomain, start: State, avoided: AvoidSet) -> PlanPath | None:
    """A twin: it makes a detour where there is one."""
    direct = shortest_plan(domain, start, avoided)
    for choice in domain.choices if direct else ():
        if domain.can_start(choice, start) and (start, choice) not in avoided.pairs:
            for then, outcome, _ in domain.after(choice, start):
                rest = None if outcome.failure else shortest_plan(domain, then, avoided)
                if rest is not None and start not in [state for state, _ in rest] and then != start:
                    return [(start, choice), *rest]
    return direct


@pytest.mark.parametrize("twin", [_Careless, _Bold, _Ruthless])
def test_a_domain_that_is_wrong_in_one_way_is_noticed(twin: type[PlanningDomain]) -> None:
    def compare(problem: Problem) -> None:
        right = domain_of(problem)
        judge(
            problem,
            StrongCyclicStrategy(twin(**{one.name: getattr(right, one.name) for one in fields(right)})),
            Mix(),
        )

    with pytest.raises((AssertionError, KeyError)):
        _law(compare, 400, phases=[Phase.generate])


def test_plans_that_are_not_the_shortest_are_noticed() -> None:
    with pytest.raises(AssertionError):
        _law(
            lambda problem: judge(problem, StrongCyclicStrategy(domain_of(problem), roundabout), Mix()),
            400,
            phases=[Phase.generate],
        )


def _law(check: Callable[[Problem], None], count: int, **more: Any) -> None:
    @examples(count, **more)
    @given(problems())
    def law(problem: Problem) -> None:
        check(problem)

    law()


def test_a_plan_from_elsewhere_is_accepted_exactly_where_it_works() -> None:
    seen = Mix()
    _plans_are_judged(seen)
    seen.assert_both("plan", at_least=15)


class _Hopeful(StrongCyclicStrategy):
    """A twin: it will turn out well."""

    def solves(self, start: State) -> bool:
        return True


def test_a_judge_that_minds_no_outcome_is_noticed() -> None:
    target, broken = NAMES[:2]
    outcomes = [
        Outcome("done", {target: True}, False, None, None),
        Outcome("broken", {broken: True}, True, None, None),
    ]
    only = skill("only", *outcomes, precondition=f"not {broken}")
    start = {**dict.fromkeys(NAMES, False), "area": "table"}
    problem = Problem(module("small", (only,)), site(), term(target), (), start)
    _judge_plan(problem, ["only"], StrongCyclicStrategy, Mix())
    with pytest.raises(AssertionError, match="plan is proved"):
        _judge_plan(problem, ["only"], _Hopeful, Mix())


def _plans_are_judged(seen: Mix) -> None:
    @examples(225)
    @given(problems(), st.data())
    def law(problem: Problem, data: st.DataObject) -> None:
        _judge_plan(problem, data.draw(_steps(problem)), StrongCyclicStrategy, seen)

    law()


def _judge_plan(problem: Problem, steps: list[str], strategy: type[StrongCyclicStrategy], seen: Mix) -> None:
    labels = [f"{problem.ecm.id}.{name}" for name in steps]
    modules = {problem.ecm.id: problem.ecm}
    domain = domain_for(
        modules, problem.site, problem.start, problem.goal, problem.invariants, extra_variables=labels
    )
    wrong = find_step_problems(strategy(domain), domain.state(problem.start), labels)
    seen.compare("plan", proved=not wrong, expected=works(Enumeration(problem), steps))


@st.composite
def _steps(draw: st.DrawFn, problem: Problem) -> list[str]:
    """Any skills, or what a strategy does where its steps succeed one way."""
    strategy = StrongCyclicStrategy(domain_of(problem))
    domain, state = strategy.domain, strategy.domain.state(problem.start)
    if not strategy.solves(state) or draw(st.booleans()):
        return draw(st.lists(st.sampled_from([*problem.ecm.skills]), max_size=4))
    steps: list[str] = []
    while domain.goal(state) is not True and len(steps) < 8:
        chosen = strategy.chosen[state]
        steps.append(chosen.skill.id)
        state = draw(st.sampled_from([then for then, o, _ in domain.after(chosen, state) if not o.failure]))
    return steps


def works(every: Enumeration, steps: Sequence[str]) -> bool:
    """By enumeration: each step starts after any successes, and no outcome leaves the states with hope."""
    states = {every.start}
    for name in steps:
        one = every.problem.ecm.skills[name]
        pending = {state for state in states if not every.holds(every.problem.goal, state)}
        states -= pending
        for state in pending:
            if one.precondition is not None and not every.holds(one.precondition.term, state):
                return False
            for then, failed in every.ends(one, state):
                if then not in every.hopeful:
                    return False
                states |= set() if failed else {then}
    return all(every.holds(every.problem.goal, state) for state in states)


class Proposing:
    """Proposes one plan, whatever is measured."""

    name = "proposing"

    def __init__(self, graph: TaskGraph) -> None:
        self._graph = graph

    def plan(self, routed: RoutedTask, world: WorldModel, modules: Mapping[str, Ecm]) -> TaskGraph:
        return self._graph


@st.composite
def _graphs(draw: st.DrawFn, problem: Problem) -> TaskGraph:
    """Generate plans of the planner without rules, variations of them with other parts, or any steps."""
    names = [*problem.ecm.skills]
    strategy = StrongCyclicStrategy(domain_of(problem))
    start = strategy.domain.state(problem.start)
    solved = strategy.solves(start) and draw(st.booleans())
    parts = list(strategy_to_graph(strategy, start, 3).parts) if solved else []
    for _ in range(draw(st.integers(0 if solved else 1, 3))):
        between, last = (
            None if name is None else PlanStep("small", name)
            for name in (draw(st.sampled_from([None, *names])), draw(st.sampled_from([None, None, *names])))
        )
        step = PlanStep("small", draw(st.sampled_from(names)), {}, draw(st.integers(0, 3)), between, last)
        at = draw(st.integers(0, len(parts)))
        parts[at : at + draw(st.integers(0, 1))] = [step]
    return TaskGraph(tuple(parts))


def _judged_plans_are_run(problem: Problem, graph: TaskGraph, seed: int, seen: Counter[str]) -> None:
    every = Enumeration(problem)
    pursued = replace(
        task("task", ("word",), "area == pot"), goal=problem.goal, invariants=problem.invariants
    )
    once = replace(problem.site, limits=replace(problem.site.limits, replans=0))
    chance = random.Random(seed)  # noqa: S311 - draws outcomes
    likely = {
        one.id: [outcome.id for outcome in one.outcomes.values() if outcome.probability != 0]
        for one in problem.ecm.skills.values()
    }
    modules = {problem.ecm.id: problem.ecm}
    if every.holds(problem.goal, every.start) or verify_plan(graph, modules, once):
        return
    for _ in range(8):
        runtime = Recording(problem.ecm, once, problem.start, lambda name, _: chance.choice(likely[name]))
        world = world_from_readings(once.state, runtime.observe(), runtime.now())
        accepted = not PlanChecker(RoutedTask("small", pursued), world, modules, once).problems(graph)
        report = pursue(problem.ecm, pursued, runtime, Proposing(graph))
        seen[f"accepted {accepted}, reached {report.reached}"] += 1
        if accepted:
            assert {frozenset(state.items()) for state in runtime.states} <= every.hopeful
            assert report.reached or report.steps[-1].failed


def test_a_plan_that_is_accepted_reaches_the_goal_unless_a_step_fails_and_never_leaves_hope() -> None:
    seen = Counter[str]()
    _judged_in_runs(seen)
    assert seen["accepted True, reached True"] > 15
    assert seen["accepted False, reached False"] > 15


@pytest.mark.deep
def test_a_judge_of_graphs_that_minds_no_outcome_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("aeros.agent.planning.check_plan.StrongCyclicStrategy", _Hopeful)
    with pytest.raises(AssertionError):
        _judged_in_runs(Counter(), 1000, phases=[Phase.generate])


def _judged_in_runs(seen: Counter[str], count: int = 100, **more: Any) -> None:
    @examples(count, **more)
    @given(problems(), st.data(), st.integers(0, 2**32))
    def law(problem: Problem, data: st.DataObject, seed: int) -> None:
        _judged_plans_are_run(problem, data.draw(_graphs(problem)), seed, seen)

    law()


def test_a_plan_written_as_json_is_read_unchanged() -> None:
    forks = Counter[bool]()

    @examples(100)
    @given(problems())
    def law(problem: Problem) -> None:
        strategy = StrongCyclicStrategy(domain_of(problem))
        start = strategy.domain.state(problem.start)
        if strategy.solves(start):
            graph = strategy_to_graph(strategy, start, 3)
            read = plan_from_json(parse_strict_json(json.dumps(plan_to_json(graph))), problem.site)
            # An `else` that is one `if` is read as a sequence of one part, which is the same to do.
            assert plan_to_json(read) == plan_to_json(graph)
            conditions = [
                [part.condition for part in walk_parts(one.body) if isinstance(part, If)]
                for one in (graph, read)
            ]
            assert conditions[0] == conditions[1]
            forks[bool(conditions[0])] += 1

    law()
    assert forks[True] > 1
