"""The planner that lets a classical planner search, and checks what it finds by what skills declare.

A classical planner knows one outcome for each action, the one hoped for.  What comes of the others is
settled around it, as for the planner `smt`: it is asked for a plan from every state that any outcome leads
to, and what leads to a state without one is excluded from then on (`cyclic`).

It is not believed: each of its plans is walked through, step by step, before anything rests on it.  What it
can do is find no plan where there is one.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, Protocol

from aeros.agent.planning.classical import EngineError
from aeros.agent.planning.routing import Routed
from aeros.agent.planning.smt import NoPlanError, why_not
from aeros.agent.planning.strategy_to_graph import task_graph
from aeros.agent.planning.task_graph import TaskGraph
from aeros.agent.world.world import World
from aeros.spec.closed_loop.invocation import State
from aeros.spec.model.model import Ecm, Outcome, Site
from aeros.spec.planning.domain import Choice, Domain, domain_for
from aeros.spec.planning.pddl import action_name, as_pddl
from aeros.spec.planning.search_result import Avoided, NotDecidedError, Path
from aeros.spec.planning.strong_cyclic import Strategy

_MOST_ASKED: Final = 100


class Engine(Protocol):
    """A classical planner; see `classical.Engine`."""

    def solve(self, domain: str, problem: str) -> list[str] | None:
        """The names of the actions of a plan, or None; may raise `EngineError`."""


class ClassicalPlanner:
    """Plans for the goal of the task, whatever its rules are."""

    def __init__(self, site: Site, engine: Engine) -> None:
        self._site = site
        self._engine = engine

    @property
    def name(self) -> str:
        """As shown in the audit record."""
        return "pddl"

    def plan(self, routed: Routed, world: World, modules: Mapping[str, Ecm]) -> TaskGraph:
        """The plan; raises `NoPlanError`, or `NotDecidedError` where the engine does not say or errs."""
        task = routed.task
        domain = domain_for(modules, self._site, world.known, task.goal, task.invariants)
        strategy, start = Strategy(domain, Finder(self._engine)), domain.state(world.known)
        if not strategy.solves(start):
            raise NoPlanError(why_not(strategy))
        return task_graph(strategy, start, self._site.limits.retries)


class Finder:
    """Finds plans that count on successes (`cyclic.Finder`) by asking an engine."""

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._asked = 0

    def __call__(self, domain: Domain, start: State, avoided: Avoided) -> Path | None:
        """A plan from `start` that keeps out of what is avoided; None where the engine finds none."""
        if start in avoided.states or domain.broken(start) is not None:
            return None
        actions = {
            action_name(choice, outcome.id).casefold(): (choice, outcome)
            for choice in domain.choices
            for outcome in choice.skill.outcomes.values()
        }
        excluded: list[tuple[State, str]] = []
        while True:
            self._asked += 1
            if self._asked > _MOST_ASKED:
                raise NotDecidedError(f"the engine was asked for {_MOST_ASKED} plans, and more are needed")
            try:
                found = self._engine.solve(*as_pddl(domain, start, excluded))
            except EngineError as error:
                raise NotDecidedError(f"the engine does not say: {error}") from error
            if found is None:
                return None
            path = _walked(domain, start, avoided, [name.casefold() for name in found], actions)
            if isinstance(path, list):
                return path
            if path in excluded:
                raise NotDecidedError(f"the engine uses `{path[1]}` where that is excluded")
            excluded.append(path)


def _walked(
    domain: Domain,
    start: State,
    avoided: Avoided,
    names: list[str],
    actions: Mapping[str, tuple[Choice, Outcome]],
) -> Path | tuple[State, str]:
    """The way that these actions go; or the first of them that may not be used, and where."""
    path: Path = []
    state = start
    for name in names:
        if domain.goal(state) is True:
            break
        if name not in actions:
            raise NotDecidedError(f"the engine's plan has `{name[:80]}`, which is no action")
        choice, outcome = actions[name]
        pairs = zip(domain.names, state, strict=True)
        then = tuple(outcome.effects.get(name, value) for name, value in pairs)
        successes = [one for one, measured, _ in domain.after(choice, state) if not measured.failure]
        if not domain.can_start(choice, state) or then not in successes:
            raise NotDecidedError(f"the engine's plan has `{name}` where that is impossible")
        if (state, choice) in avoided.pairs or then in avoided.states or domain.broken(then) is not None:
            return state, name
        path.append((state, choice))
        state = then
    if domain.goal(state) is not True:
        raise NotDecidedError("the engine's plan ends before the goal")
    return path
