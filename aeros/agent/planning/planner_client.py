"""How a planner is asked: at once, or beside the plant's time for so long and no longer.

A planner that answers at once, such as the one by rules, is asked in place.  Any other thinks beside
(`beside`): its plan comes back as data, and when it is late there is still what is left of the plan before,
where that is found to lead to the goal from what is measured now.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import inf
from typing import Any

from aeros.agent.planning.base import Planner
from aeros.agent.planning.check_plan import PlanChecker
from aeros.agent.planning.plan_json import MalformedPlanError, plan_from_json, plan_to_json
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import TaskGraph
from aeros.agent.planning.time_limited import (
    MOST_REASON,
    PlannerProcess,
    PlannerProcessError,
    PlanningTimeoutError,
)
from aeros.agent.world.world import WorldModel
from aeros.descriptions import describe_exception
from aeros.runtime.ports import Runtime


class PlannerClient:
    """What one planner proposes.

    within: seconds allowed for a plan that is made beside, where the site does not allow fewer; None where
        it is made in place.
    """

    def __init__(self, runtime: Runtime, planner: Planner, timeout_s: float | None = None) -> None:
        self._runtime = runtime
        self._planner = planner
        self._within = timeout_s

    @property
    def name(self) -> str:
        """The planner's."""
        return self._planner.name

    def plan(self, routed: RoutedTask, world: WorldModel, until: float = inf) -> TaskGraph:
        """What the planner proposes; raises `PlanningTimeoutError` and `PlannerProcessError`.

        until: plant seconds after which it is not waited for.
        """
        modules = self._runtime.active_modules()
        if self._within is None:
            try:
                return self._planner.plan(routed, world, modules)
            except Exception as error:  # an untrusted planner may raise anything
                raise PlannerProcessError(describe_exception(error, MOST_REASON, one_line=True)) from error

        def propose() -> tuple[Any, str]:
            graph = self._planner.plan(routed, world, modules)
            return plan_to_json(graph), graph.remark

        match self._run(propose, self._within, until):
            case [form, remark]:
                pass
            case _:
                raise PlannerProcessError("its process has said something else than a plan")
        try:
            return replace(plan_from_json(form, self._runtime.site), remark=remark)
        except MalformedPlanError as error:
            raise PlannerProcessError(describe_exception(error, MOST_REASON, one_line=True)) from error

    def remaining_plan(
        self, previous: TaskGraph, routed: RoutedTask, world: WorldModel, until: float = inf
    ) -> TaskGraph | None:
        """The shortest end of `previous` that leads from `world` to the goal; None unless found in time."""
        if self._within is None:
            return None
        judge = PlanChecker(routed, world, self._runtime.active_modules(), self._runtime.site)
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

    def _run(self, job: Callable[[], Any], within: float, until: float) -> Any:
        """What `job` comes to, in the time that the site allows by now."""
        allowed = min(within, float(self._runtime.site.limits.planning))
        return PlannerProcess(self._runtime, allowed, until)(job)
