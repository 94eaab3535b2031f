"""Check of a client's plan, by the same rules as `aeros plan check` and as the agent's check of every plan.

The check uses the default inputs of skills, so a step may only set inputs that have no default.  Steps are
not retried, because the check does not cover the state after a failed try.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import PlanStep, TaskGraph, verify_plan
from aeros.agent.world.values import to_json_value
from aeros.agent.world.world import WorldModel
from aeros.apps.mcp.tool_arguments import ProposedStep
from aeros.spec.backends.oracle import Oracle
from aeros.spec.model.ecm import ActionCondition, Ecm
from aeros.spec.model.site import Site
from aeros.spec.planning.domain import PlanningDomain, domain_for
from aeros.spec.planning.plan_check import find_step_problems
from aeros.spec.planning.search_result import PlanUndecidedError
from aeros.spec.planning.strong_cyclic import StrongCyclicStrategy


@dataclass(frozen=True, slots=True)
class ClientPlan:
    """Plan of a client.

    Attributes:
        steps: Its steps, which run in this order.
        goal: Condition that must hold after them.
        routed: The task whose invariants hold meanwhile.
    """

    steps: tuple[ProposedStep, ...]
    goal: ActionCondition
    routed: RoutedTask

    @property
    def graph(self) -> TaskGraph:
        """The plan as a task graph of the agent."""
        named = ((*step.skill.partition("."), step.inputs) for step in self.steps)
        return TaskGraph(tuple(PlanStep(module, skill, inputs) for module, _, skill, inputs in named))


class ClientPlanChecker:
    """Checker of client plans under the site in force; for use by one thread.

    Args:
        site: Returns the site in force.
    """

    def __init__(self, site: Callable[[], Site]) -> None:
        self._site = site
        self._oracle = Oracle()

    def problems(
        self, plan: ClientPlan, routed: RoutedTask, world: WorldModel, modules: Mapping[str, Ecm]
    ) -> list[str]:
        """Check a plan.

        Args:
            plan: The client's plan.
            routed: The task, as the agent pursues it now.
            world: The measured state from which the plan would start.
            modules: The active modules by id.

        Returns:
            The reasons against the plan; empty if and only if it is accepted.
        """
        site = self._site()
        formal = [*_policy_problems(plan.steps, site), *_repeated_defaults(plan.steps, modules)]
        if formal or (formal := verify_plan(plan.graph, modules, site)):
            return formal
        also = {step.skill.casefold() for step in plan.steps}
        known, kept = world.known, routed.task.invariants
        domain = domain_for(modules, site, known, plan.goal.term, kept, self._oracle, also)
        labels = [_label(domain, step) for step in plan.steps]
        try:
            return find_step_problems(StrongCyclicStrategy(domain), domain.state(known), labels)
        except PlanUndecidedError as why:
            return [f"rejected: acceptance could not be decided: {why}"]


def _policy_problems(steps: Sequence[ProposedStep], site: Site) -> list[str]:
    allowed, most = site.mcp.skills, site.mcp.max_steps
    if len(steps) > most:
        return [f"the plan has {len(steps)} steps; this site allows {most}"]
    return [
        f"step {number}: this site's `policy.mcp.skills` does not have `{step.skill}`"
        for number, step in enumerate(steps, 1)
        if allowed is not None and step.skill not in allowed
    ]


def _repeated_defaults(steps: Sequence[ProposedStep], modules: Mapping[str, Ecm]) -> list[str]:
    found = []
    for number, step in enumerate(steps, 1):
        module, _, name = step.skill.partition(".")
        skill = modules[module].skills.get(name) if module in modules else None
        given = [] if skill is None else [one for one in step.inputs if one in skill.inputs]
        found += [
            f"step {number}: omit `{one}`; plans are checked with its default"
            for one in given
            if skill is not None and skill.inputs[one].default_value is not None
        ]
    return found


def _label(domain: PlanningDomain, step: ProposedStep) -> str:
    """Return the planning domain's label of a step, or a text of the same form if the domain lacks it."""
    for choice in domain.choices:
        inputs = {name: to_json_value(value) for name, value in choice.inputs.items()}
        if choice.name == step.skill and inputs == dict(step.inputs):
            return choice.label
    return " ".join([step.skill, *(f"{name}={value}" for name, value in step.inputs.items())])
