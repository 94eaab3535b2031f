"""A planner that really takes its time: it sleeps, and then plans by the task's rules."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

from aeros.agent.planning.base import RulePlanner
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import PlanStep, TaskGraph
from aeros.agent.world.world import WorldModel
from aeros.spec.model.model import Ecm


class SlowPlanner:
    """The planning rules, some seconds later.

    first, again: what the first plan takes, and each that follows a failure, s.
    taken: what becomes of each step.
    """

    name = "rules"

    def __init__(
        self,
        first_delay_s: float,
        replan_delay_s: float,
        transform_step: Callable[[PlanStep], PlanStep] = lambda step: step,
    ) -> None:
        self._first = first_delay_s
        self._again = replan_delay_s
        self._taken = transform_step
        self._rules = RulePlanner()

    def plan(self, routed: RoutedTask, world: WorldModel, modules: Mapping[str, Ecm]) -> TaskGraph:
        """See `Planner`."""
        time.sleep(self._again if world.failures else self._first)
        graph = self._rules.plan(routed, world, modules)
        return TaskGraph(tuple(map(self._taken, graph.steps)))
