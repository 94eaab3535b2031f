"""The planning function F of the paper: from the measured world to a task graph.

A planner is a replaceable, untrusted component: whatever it returns is verified before its first
step, every step is checked again on the measured world, and every action is decided by the gate.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import PlanStep, TaskGraph
from aeros.agent.world.world import WorldModel
from aeros.spec.model.model import Ecm


class Planner(Protocol):
    """Anything that can propose a plan; it may be wrong, and it may raise."""

    @property
    def name(self) -> str:
        """As shown in the audit record."""

    def plan(self, task: RoutedTask, world: WorldModel, modules: Mapping[str, Ecm]) -> TaskGraph:
        """Steps that should lead from `world` to the goal of the task, by skills of active `modules`."""


class RulePlanner:
    """The planning rules of the task's manifest (the paper's Appendix A): the same world, the same plan."""

    @property
    def name(self) -> str:
        """As shown in the audit record."""
        return "rules"

    def plan(self, routed: RoutedTask, world: WorldModel, modules: Mapping[str, Ecm]) -> TaskGraph:
        """The steps, in order, of the rules whose `satisfied_condition` is not measured; unknown is not measured."""
        return TaskGraph(
            tuple(
                PlanStep(
                    routed.module,
                    rule.skill,
                    rule.inputs,
                    rule.retry,
                    rule.on_failure,
                    rule.satisfied_condition,
                )
                for rule in routed.task.rules
                if world.evaluate(rule.satisfied_condition) is not True
            )
        )
