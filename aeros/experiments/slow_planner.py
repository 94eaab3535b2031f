"""A planner that really takes its time: it sleeps, and then plans by the task's rules."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

from aeros.agent.graph import Step, TaskGraph
from aeros.agent.planner import RulePlanner
from aeros.agent.routing import Routed
from aeros.agent.world import World
from aeros.spec.model import Ecm


class SlowPlanner:
    """The planning rules, some seconds later.

    first, again: what the first plan takes, and each that follows a failure, s.
    taken: what becomes of each step.
    """

    name = "rules"

    def __init__(self, first: float, again: float, taken: Callable[[Step], Step] = lambda step: step) -> None:
        self._first = first
        self._again = again
        self._taken = taken
        self._rules = RulePlanner()

    def plan(self, routed: Routed, world: World, modules: Mapping[str, Ecm]) -> TaskGraph:
        """See `Planner`."""
        time.sleep(self._again if world.failures else self._first)
        graph = self._rules.plan(routed, world, modules)
        return TaskGraph(tuple(map(self._taken, graph.steps)))
