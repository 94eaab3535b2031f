"""Planner that needs no rules: the shortest plan that no declared outcome can lead into a dead end."""

from __future__ import annotations

from aeros.agent.planning.strong_cyclic import StrongCyclicPlanner
from aeros.spec.planning.shortest import shortest_plan
from aeros.spec.planning.strong_cyclic import PathFinder


class SmtPlanner(StrongCyclicPlanner):
    """Planner whose paths to the goal are the shortest."""

    @property
    def name(self) -> str:
        """Name in the audit record."""
        return "smt"

    def path_finder(self) -> PathFinder:
        """Implement `StrongCyclicPlanner.path_finder` by a search for shortest paths."""
        return shortest_plan
