"""Planning by the preconditions and outcomes of all active skills, without planning rules.

While every outcome is a declared one, the agent never reaches a state from which the goal cannot be reached.
If no plan guarantees this, no plan is proposed, and the error says which outcome leads into a dead end.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping

from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.strategy_to_graph import strategy_to_graph
from aeros.agent.planning.task_graph import TaskGraph
from aeros.agent.world.world import WorldModel
from aeros.spec.backends.oracle import Oracle
from aeros.spec.closed_loop.invocation import State
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.site import Site
from aeros.spec.planning.domain import PlanningDomain, domain_for
from aeros.spec.planning.strong_cyclic import StrongCyclicStrategy


class NoPlanError(Exception):
    """A goal that cannot be relied on to stay reachable; the message says why."""


class StrongCyclicPlanner(ABC):
    """Planner for the goal of the task that ignores its planning rules; subclasses choose the search.

    `site` is the site whose policy governs.
    """

    def __init__(self, site: Site) -> None:
        self.site = site
        self._oracle = Oracle()

    @property
    @abstractmethod
    def name(self) -> str:
        """Name in the audit record."""

    @abstractmethod
    def find_strategy(self, domain: PlanningDomain, start: State) -> StrongCyclicStrategy:
        """Search for a strategy.

        Args:
            domain: planning domain.
            start: first state.

        Returns:
            The strategy; one that does not solve `start` if there is none.

        Raises:
            PlanUndecidedError: the search was given up.
        """

    def graph_of(self, strategy: StrongCyclicStrategy, start: State) -> TaskGraph:
        """Convert a strategy to a plan.

        Args:
            strategy: strategy that solves `start`.
            start: first state.

        Returns:
            The plan.
        """
        return strategy_to_graph(strategy, start, self.site.limits.retries)

    def plan(self, routed: RoutedTask, world: WorldModel, modules: Mapping[str, Ecm]) -> TaskGraph:
        """Search for a plan.

        Args:
            routed: task to plan for.
            world: current state.
            modules: active modules by id.

        Returns:
            The plan.

        Raises:
            NoPlanError: the goal cannot be relied on to stay reachable.
            PlanUndecidedError: the search was given up.
        """
        task = routed.task
        domain = domain_for(modules, self.site, world.known, task.goal, task.invariants, self._oracle)
        start = domain.state(world.known)
        strategy = self.find_strategy(domain, start)
        if not strategy.solves(start):
            raise NoPlanError(explain_no_plan(strategy))
        return self.graph_of(strategy, start)


def explain_no_plan(strategy: StrongCyclicStrategy) -> str:
    """Explain why there is no plan: the first dead end that was found, and the steps that lead to it.

    Args:
        strategy: strategy that does not solve the start state.

    Returns:
        The explanation in words, with the skills that were left out.
    """
    dead_end, domain = strategy.dead_ends[0], strategy.domain
    why = f"no plan reaches the goal: {dead_end.reason}"
    if dead_end.trace:
        way, state = ", ".join(dead_end.trace), domain.format_state(dead_end.state)
        why = f"no plan recovers from every outcome: {way} leads to {state}, and there {dead_end.reason}"
    return "; ".join(
        [why, *(f"`{name}` is left out: {reason}" for name, reason in domain.excluded_skills.items())]
    )
