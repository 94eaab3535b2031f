"""A planner that really needs time: it sleeps, and then plans by the task's rules."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

from aeros.agent.planning.base import RulePlanner
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import PlanStep, TaskGraph
from aeros.agent.world.world import WorldModel
from aeros.spec.model.ecm import Ecm


class SlowPlanner:
    """Planning rules with a delay.

    Args:
        first_delay_s: time that the first plan takes, s.
        replan_delay_s: time that each plan after a failure takes, s.
        transform_step: applied to each step of a plan.
    """

    name = "rules"

    def __init__(
        self,
        first_delay_s: float,
        replan_delay_s: float,
        transform_step: Callable[[PlanStep], PlanStep] = lambda step: step,
    ) -> None:
        self._first_delay_s = first_delay_s
        self._replan_delay_s = replan_delay_s
        self._transform_step = transform_step
        self._rules = RulePlanner()

    def plan(self, routed: RoutedTask, world: WorldModel, modules: Mapping[str, Ecm]) -> TaskGraph:
        """Implement `Planner.plan`."""
        time.sleep(self._replan_delay_s if world.failures else self._first_delay_s)
        graph = self._rules.plan(routed, world, modules)
        return TaskGraph(tuple(map(self._transform_step, graph.steps)))
