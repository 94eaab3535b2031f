"""Planner that lets a classical planner search, and checks the plans that it finds.

A classical planner knows one outcome of each action, the hoped-for one. The other outcomes are handled around
it, as for the planner `smt`: it is asked for a plan from every state that any outcome leads to, and an action
that leads to a state without a plan is excluded from then on (`strong_cyclic.py`).

Each of its plans is simulated step by step before it is used, so its errors do no harm. It may miss a plan
that exists.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, Protocol

from aeros.agent.planning.classical import ClassicalEngineError
from aeros.agent.planning.strong_cyclic import StrongCyclicPlanner
from aeros.spec.closed_loop.invocation import State
from aeros.spec.expr.effects import value_after
from aeros.spec.model.ecm import Outcome
from aeros.spec.model.site import Site
from aeros.spec.planning.domain import GroundSkill, PlanningDomain
from aeros.spec.planning.pddl import action_name, write_pddl
from aeros.spec.planning.search_result import AvoidSet, PlanPath, PlanUndecidedError
from aeros.spec.planning.strong_cyclic import StrongCyclicStrategy

_MAX_ENGINE_CALLS: Final = 100


class ClassicalEngine(Protocol):
    """Port of classical planners; see `classical.UnifiedPlanningEngine`."""

    def solve(self, domain: str, problem: str) -> list[str] | None:
        """Solve a planning problem; may raise `ClassicalEngineError`.

        Args:
            domain: PDDL text of the domain.
            problem: PDDL text of the problem.

        Returns:
            The names of the plan's actions; None if there is no plan.
        """


class PddlPlanner(StrongCyclicPlanner):
    """Planner whose paths to the goal are those of a classical planner."""

    def __init__(self, site: Site, engine: ClassicalEngine) -> None:
        super().__init__(site)
        self._engine = engine

    @property
    def name(self) -> str:
        """Name in the audit record."""
        return "pddl"

    def find_strategy(self, domain: PlanningDomain, start: State) -> StrongCyclicStrategy:
        """Implement `StrongCyclicPlanner.find_strategy` by asking the engine, with a new budget of calls."""
        return StrongCyclicStrategy(domain, OptimisticPlanFinder(self._engine))


class OptimisticPlanFinder:
    """Finder of plans that count on successes, which asks an engine; a `strong_cyclic.PathFinder`."""

    def __init__(self, engine: ClassicalEngine) -> None:
        self._engine = engine
        self._asked = 0

    def __call__(self, domain: PlanningDomain, start: State, avoided: AvoidSet) -> PlanPath | None:
        """Find a plan from `start` that avoids the given states and pairs; None if the engine finds none.

        Raises:
            PlanUndecidedError: the engine gave no usable answer, or was asked too often.
        """
        if start in avoided.states or domain.violated_invariant(start) is not None:
            return None
        actions = {
            action_name(choice, outcome.id).casefold(): (choice, outcome)
            for choice in domain.choices
            for outcome in choice.skill.outcomes.values()
        }
        excluded: list[tuple[State, str]] = []
        while True:
            self._asked += 1
            if self._asked > _MAX_ENGINE_CALLS:
                raise PlanUndecidedError(
                    f"the engine has made {_MAX_ENGINE_CALLS} plans, the most, and more are needed"
                )
            try:
                found = self._engine.solve(*write_pddl(domain, start, excluded))
            except ClassicalEngineError as error:
                raise PlanUndecidedError(f"the engine gave no answer: {error}") from error
            if found is None:
                return None
            path = _simulate(domain, start, avoided, [name.casefold() for name in found], actions)
            if isinstance(path, list):
                return path
            if path in excluded:
                raise PlanUndecidedError(f"the engine uses `{path[1]}` where that is excluded")
            excluded.append(path)


def _simulate(
    domain: PlanningDomain,
    start: State,
    avoided: AvoidSet,
    names: list[str],
    actions: Mapping[str, tuple[GroundSkill, Outcome]],
) -> PlanPath | tuple[State, str]:
    """Return the path that these actions take, or the first action that must not be used, with its state.

    Raises:
        PlanUndecidedError: the engine's plan is not a plan of this domain.
    """
    path: PlanPath = []
    state = start
    for name in names:
        if domain.goal(state) is True:
            break
        if name not in actions:
            raise PlanUndecidedError(f"the engine's plan has `{name[:80]}`, which is not an action")
        choice, outcome = actions[name]
        pairs = zip(domain.names, state, strict=True)
        then = tuple(value_after(outcome.effects.get(name, value), value) for name, value in pairs)
        successes = [one for one, measured, _ in domain.after(choice, state) if not measured.failure]
        if not domain.can_start(choice, state) or then not in successes:
            raise PlanUndecidedError(f"the engine's plan has `{name}` where that is impossible")
        if (
            (state, choice) in avoided.pairs
            or then in avoided.states
            or domain.violated_invariant(then) is not None
        ):
            return state, name
        path.append((state, choice))
        state = then
    if domain.goal(state) is not True:
        raise PlanUndecidedError("the engine's plan ends before the goal")
    return path
