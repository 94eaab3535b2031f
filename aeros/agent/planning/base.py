"""The planning function F(o, s) of the paper: from the measured world o and memory s to a task graph.

Memory comes in the modules, as the learned probabilities and durations of outcomes, and in the world, as the
failures since the previous plan.

A planner is a replaceable, untrusted component: whatever it returns is verified before its first
step, every step is checked again on the measured world, and every action is decided by the gate.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import PlanStep, TaskGraph
from aeros.agent.world.world import WorldModel
from aeros.spec.model.ecm import Ecm, PlanningRule, owner_of


class Planner(Protocol):
    """Port of planners. A planner proposes plans; it may be wrong, and it may raise."""

    @property
    def name(self) -> str:
        """Name in the audit record."""

    def plan(self, task: RoutedTask, world: WorldModel, modules: Mapping[str, Ecm]) -> TaskGraph:
        """Propose steps that should lead from `world` to the goal of the task.

        Args:
            task: task to plan for.
            world: current state.
            modules: active modules by id, whose skills the plan may use; the probabilities and durations of
                their outcomes are those that memory has learned, where it knows any.

        Returns:
            The plan.
        """


class RulePlanner:
    """Planner that follows the planning rules of the task in its module's manifest.

    The same world gives the same plan.
    """

    @property
    def name(self) -> str:
        """Name in the audit record."""
        return "rules"

    def plan(self, routed: RoutedTask, world: WorldModel, modules: Mapping[str, Ecm]) -> TaskGraph:
        """List the skills of the rules that are not measured as satisfied, in the order of the rules.

        Args:
            routed: task to plan for.
            world: current state; a rule is satisfied where the known values alone decide that.
            modules: active modules by id; unused.

        Returns:
            The plan, which may be empty.
        """
        return TaskGraph(
            tuple(
                step_of_rule(routed.module, rule)
                for rule in routed.task.rules
                if world.truth_by_known_values(rule.satisfied_condition) is not True
            )
        )


def step_of_rule(module: str, rule: PlanningRule) -> PlanStep:
    """Make the step that a planning rule asks for.

    Args:
        module: id of the module that declares the rule.
        rule: the rule.

    Returns:
        The step, with the steps that its failure leads to.
    """
    between, last = (
        None if name is None else PlanStep(*owner_of(name, module))
        for name in (rule.between_tries, rule.on_failure)
    )
    return PlanStep(
        *owner_of(rule.skill, module), rule.inputs, rule.retry, between, last, rule.satisfied_condition
    )
