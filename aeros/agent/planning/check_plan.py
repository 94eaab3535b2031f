"""Check that a plan leads to the goal from the measured state, by the declared outcomes of its skills.

`verify_plan` decides if a plan may be started. This check is stronger: each step can start after any
successes of the steps before it, no declared outcome leaves the states from which the goal can be reached,
and the goal is reached at the end. The check is incomplete: plans with parallel branches, or with inputs
other than declared defaults and values of a small finite type, are not judged and therefore not accepted.
"""

from __future__ import annotations

from collections.abc import Mapping

from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import PlanStep, TaskGraph
from aeros.agent.world.values import UnusableValueError, to_exact
from aeros.agent.world.world import WorldModel
from aeros.spec.backends.oracle import Oracle
from aeros.spec.model.ecm import Ecm, owner_of
from aeros.spec.model.site import Site
from aeros.spec.model.step_graph import map_graph_steps
from aeros.spec.planning.domain import GroundSkill, PlanningDomain, domain_for
from aeros.spec.planning.plan_check import PlannedStep, find_plan_problems
from aeros.spec.planning.search_result import PlanUndecidedError
from aeros.spec.planning.strong_cyclic import StrongCyclicStrategy


class PlanChecker:
    """Checker of plans for one task from one world.

    Args:
        routed: the task.
        world: the measured world.
        modules: active modules by id.
        site: site whose rules apply.
        oracle: solver that remembers its answers; by default a new one for each plan.
    """

    def __init__(
        self,
        routed: RoutedTask,
        world: WorldModel,
        modules: Mapping[str, Ecm],
        site: Site,
        oracle: Oracle | None = None,
    ) -> None:
        self._oracle = oracle
        self._task = routed.task
        self._world = world
        self._modules = modules
        self._site = site

    def problems(self, graph: TaskGraph) -> list[str]:
        """List the reasons not to follow a plan.

        Args:
            graph: plan that `verify_plan` accepts.

        Returns:
            The reasons; empty iff the plan is accepted.
        """
        also = {
            name.casefold()
            for step in graph.steps
            for run in (step, *(helper for _, helper in step.helpers))
            for name in self._providers(run)
        }
        task, known = self._task, self._world.known
        domain = domain_for(
            self._modules, self._site, known, task.goal, task.invariants, self._oracle, extra_variables=also
        )
        plan = map_graph_steps(graph.body, lambda step: self._to_planned_step(step, domain))
        try:
            return find_plan_problems(StrongCyclicStrategy(domain), domain.state(known), plan, known)
        except PlanUndecidedError as why:
            return [f"the plan could not be checked: {why}"]

    def _providers(self, step: PlanStep) -> tuple[str, ...]:
        """List the skills that a step may run as MODULE.SKILL, if only skills may."""
        module = self._modules.get(step.module)
        providers = () if module is None else module.providers(step.skill)
        return tuple(".".join(owner_of(name, step.module)) for name in providers)

    def _to_planned_step(self, step: PlanStep, domain: PlanningDomain) -> PlannedStep:
        name = f"{step.module}.{step.skill}"
        if step.needs_recovery or step.flows or any(helper.helpers for _, helper in step.helpers):
            return PlannedStep(
                name, (), "steps of a composition, or with outputs of other steps, cannot be checked"
            )
        choices = self._choices(domain, step)
        if isinstance(choices, str):
            return PlannedStep(name, (), choices)
        cures: dict[str, tuple[GroundSkill, ...]] = {}
        for word, helper in step.helpers:
            found = self._choices(domain, helper)
            if isinstance(found, str) or not found:
                return PlannedStep(name, (), f"{word}: {found or 'no such skill'}")
            cures[word] = found
        missing = "" if choices else "no such skill"
        between, last = cures.get("between_tries", ()), cures.get("on_failure", ())
        return PlannedStep(name, choices, missing, step.retry, between, last, step.unless)

    def _choices(self, domain: PlanningDomain, step: PlanStep) -> tuple[GroundSkill, ...] | str:
        found = [self._choice(domain, step, skill) for skill in self._providers(step)]
        problem = next((one for one in found if isinstance(one, str)), None)
        return problem or tuple(one for one in found if not isinstance(one, str))

    def _choice(self, domain: PlanningDomain, step: PlanStep, name: str) -> GroundSkill | str:
        for choice in domain.choices:
            if choice.name == name and _matches_inputs(choice, step):
                return choice
        return domain.excluded_skills.get(
            name, "it cannot be checked with inputs other than the declared defaults"
        )


def _matches_inputs(choice: GroundSkill, step: PlanStep) -> bool:
    """Return True if the step gives the skill the same inputs as the choice."""
    try:
        given = {name: to_exact(choice.skill.inputs[name], value) for name, value in step.inputs.items()}
    except (UnusableValueError, KeyError):
        return False
    declared = {name: one.default_value for name, one in choice.skill.inputs.items()} | dict(choice.inputs)
    return {**declared, **given} == declared
