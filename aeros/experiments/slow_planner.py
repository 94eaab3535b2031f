"""A planner that really takes its time: it sleeps, and then plans by the task's rules."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

from aeros.agent.planning.base import RulePlanner
from aeros.agent.planning.routing import Routed
from aeros.agent.planning.task_graph import Step, TaskGraph
from aeros.agent.world.world import World
from aeros.spec.model.model import Ecm


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
