"""Planner that needs no rules: the quickest plan that no declared outcome can lead into a dead end.

Of the plans whose risk is within a bound, the one with the least expected time is proposed (`quickest.py`).
The modules that it is given have the probabilities and durations that memory has learned, so plans change
with experience. In domains of more states than can be enumerated the plan has the fewest steps.
"""

from __future__ import annotations

from dataclasses import replace

from aeros.agent.planning.strong_cyclic import StrongCyclicPlanner
from aeros.agent.planning.task_graph import TaskGraph
from aeros.spec.closed_loop.invocation import State
from aeros.spec.planning.domain import PlanningDomain
from aeros.spec.planning.quickest import estimate_strategy, quickest_strategy
from aeros.spec.planning.strong_cyclic import StrongCyclicStrategy


class SmtPlanner(StrongCyclicPlanner):
    """Planner whose paths to the goal take the least expected time."""

    @property
    def name(self) -> str:
        """Name in the audit record."""
        return "smt"

    def find_strategy(self, domain: PlanningDomain, start: State) -> StrongCyclicStrategy:
        """Implement `StrongCyclicPlanner.find_strategy` by expected times."""
        return quickest_strategy(domain, start, self.site.limits.retries)

    def graph_of(self, strategy: StrongCyclicStrategy, start: State) -> TaskGraph:
        """Convert the strategy, with its expected time and risk as the remark.

        Args:
            strategy: strategy that solves `start`.
            start: first state.

        Returns:
            The plan.
        """
        graph = super().graph_of(strategy, start)
        estimate = estimate_strategy(strategy, start, self.site.limits.retries)
        remark = f"expected {estimate.seconds:.0f} s, risk {estimate.risk:.2g}"
        return replace(graph, remark=remark) if graph.steps else graph
