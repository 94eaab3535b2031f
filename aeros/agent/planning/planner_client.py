"""Client of a planner: asks it in place, or in a separate process with a time limit.

A planner that answers at once, such as the one by rules, is asked in place. Any other runs in a separate
process (`time_limited.py`), and its plan comes back as data. When it is late, the rest of the previous plan
can be used, if a check shows that it leads to the goal from the current state.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from math import inf
from typing import Any, TypeAlias

from aeros.agent.planning.base import Planner
from aeros.agent.planning.check_plan import PlanChecker
from aeros.agent.planning.plan_json import MalformedPlanError, plan_from_json, plan_to_json
from aeros.agent.planning.provider_freedom import accepted_places, capability_steps, with_capabilities
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import TaskGraph
from aeros.agent.planning.time_limited import (
    PlannerProcess,
    PlannerProcessError,
    PlanningTimeoutError,
    planner_failure,
)
from aeros.agent.world.world import WorldModel
from aeros.runtime.ports import Runtime
from aeros.spec.model.ecm import Ecm

Recall: TypeAlias = Callable[[Mapping[str, Ecm]], Mapping[str, Ecm]]
"""Function that gives modules what memory knows of their skills."""


class PlannerClient:
    """Client of one planner.

    `timeout_s` is the wall time (s) for a plan that is made in a separate process, if the site does not allow
    less; with None, plans are made in place. `recall` gives the active modules the probabilities and
    durations that memory has learned; plans are checked against the modules as they are declared.
    """

    def __init__(
        self,
        runtime: Runtime,
        planner: Planner,
        timeout_s: float | None = None,
        recall: Recall | None = None,
    ) -> None:
        self._recall = recall
        self._runtime = runtime
        self._planner = planner
        self._within = timeout_s

    @property
    def name(self) -> str:
        """Name of the planner."""
        return self._planner.name

    def plan(self, routed: RoutedTask, world: WorldModel, until: float = inf) -> TaskGraph:
        """Ask the planner for a plan.

        Args:
            routed: task to plan for.
            world: current state.
            until: plant time (s) at which the wait ends.

        Returns:
            The plan, not verified yet.

        Raises:
            PlanningTimeoutError: there is no plan in time.
            PlannerProcessError: the planner fails or answers with something else.
        """
        modules = self._runtime.active_modules()
        if self._recall is not None:
            modules = self._recall(modules)
        if self._within is None:
            try:
                return self._planner.plan(routed, world, modules)
            except Exception as error:  # an untrusted planner may raise anything
                raise PlannerProcessError(planner_failure(error)) from error

        modules = dict(modules)  # read before the process begins, which must not use the memory's connection

        def propose() -> tuple[Any, str]:
            graph = self._planner.plan(routed, world, modules)
            return plan_to_json(graph), graph.remark

        match self._run(propose, self._within, until):
            case [form, remark]:
                pass
            case _:
                raise PlannerProcessError("its process sent something other than a plan")
        try:
            return replace(plan_from_json(form, self._runtime.site), remark=remark)
        except MalformedPlanError as error:
            raise PlannerProcessError(planner_failure(error)) from error

    def remaining_plan(
        self, previous: TaskGraph, routed: RoutedTask, world: WorldModel, until: float = inf
    ) -> TaskGraph | None:
        """Find the shortest end of the previous plan that leads from `world` to the goal.

        Args:
            previous: plan that was followed.
            routed: task of the plan.
            world: current state.
            until: plant time (s) at which the wait ends.

        Returns:
            That end of the plan; None if there is none, it is not found in time, or plans are made in place.
        """
        if self._within is None:
            return None
        judge = self._checker(routed, world)
        ends = [TaskGraph(previous.parts[at:]) for at in range(len(previous.parts))]

        def first() -> int | None:
            fits = (
                at for at in reversed(range(len(ends))) if ends[at].steps and not judge.problems(ends[at])
            )
            return next(fits, None)

        try:
            at = self._run(first, self._within, until)
        except (PlanningTimeoutError, PlannerProcessError):
            return None
        return ends[at] if type(at) is int and 0 <= at < len(ends) else None

    def with_provider_choice(
        self,
        plan: TaskGraph,
        routed: RoutedTask,
        world: WorldModel,
        barred_skills: frozenset[str],
        until: float = inf,
    ) -> TaskGraph:
        """Let steps name the capability that their skill provides, where any provider leads to the goal.

        Args:
            plan: a verified plan.
            routed: task of the plan.
            world: current state.
            barred_skills: skills that must not be used, as MODULE.SKILL.
            until: plant time (s) at which the wait ends.

        Returns:
            The plan with these steps; unchanged if there are none, the check is not done in time, or plans
            are made in place, as planning rules name capabilities themselves.
        """
        possible = capability_steps(plan, self._runtime.active_modules(), barred_skills, routed.module)
        if self._within is None or not possible:
            return plan
        judge = self._checker(routed, world)

        def choose() -> list[int]:
            return accepted_places(plan, possible, lambda one: not judge.problems(one))

        try:
            places = self._run(choose, self._within, until)
        except (PlanningTimeoutError, PlannerProcessError):
            return plan
        accepted = {place: possible[place] for place in places if place in possible}
        return with_capabilities(plan, accepted) if accepted else plan

    def _checker(self, routed: RoutedTask, world: WorldModel) -> PlanChecker:
        """Make the checker of plans by the modules as they are declared."""
        return PlanChecker(routed, world, self._runtime.active_modules(), self._runtime.site)

    def _run(self, job: Callable[[], Any], within: float, until: float) -> Any:
        """Run `job` in a separate process, within the time that the site allows now."""
        allowed = min(within, float(self._runtime.site.limits.planning))
        return PlannerProcess(self._runtime, allowed, until)(job)
