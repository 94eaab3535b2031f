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
from aeros.agent.planning.check_plan import Judge
from aeros.agent.planning.plan_json import MalformedPlanError, form_of, graph_of
from aeros.agent.planning.routing import Routed
from aeros.agent.planning.task_graph import TaskGraph
from aeros.agent.planning.time_limited import MOST_REASON, Beside, LateError, ThinkingFailedError
from aeros.agent.world.world import World
from aeros.descriptions import describe_exception
from aeros.runtime.ports import Runtime


class Proposals:
    """What one planner proposes.

    within: seconds allowed for a plan that is made beside, where the site does not allow fewer; None where
        it is made in place.
    """

    def __init__(self, runtime: Runtime, planner: Planner, within: float | None = None) -> None:
        self._runtime = runtime
        self._planner = planner
        self._within = within

    @property
    def name(self) -> str:
        """The planner's."""
        return self._planner.name

    def plan(self, routed: Routed, world: World, until: float = inf) -> TaskGraph:
        """What the planner proposes; raises `LateError` and `ThinkingFailedError`.

        until: plant seconds after which it is not waited for.
        """
        modules = self._runtime.active_modules()
        if self._within is None:
            try:
                return self._planner.plan(routed, world, modules)
            except Exception as error:  # an untrusted planner may raise anything
                raise ThinkingFailedError(describe_exception(error, MOST_REASON, one_line=True)) from error

        def propose() -> tuple[Any, str]:
            graph = self._planner.plan(routed, world, modules)
            return form_of(graph), graph.remark

        match self._think(propose, self._within, until):
            case [form, remark]:
                pass
            case _:
                raise ThinkingFailedError("its process has said something else than a plan")
        try:
            return replace(graph_of(form, self._runtime.site), remark=remark)
        except MalformedPlanError as error:
            raise ThinkingFailedError(describe_exception(error, MOST_REASON, one_line=True)) from error

    def rest_of(
        self, previous: TaskGraph, routed: Routed, world: World, until: float = inf
    ) -> TaskGraph | None:
        """The shortest end of `previous` that leads from `world` to the goal; None unless found in time."""
        if self._within is None:
            return None
        judge = Judge(routed, world, self._runtime.active_modules(), self._runtime.site)
        ends = [TaskGraph(previous.parts[at:]) for at in range(len(previous.parts))]

        def first() -> int | None:
            fits = (
                at for at in reversed(range(len(ends))) if ends[at].steps and not judge.problems(ends[at])
            )
            return next(fits, None)

        try:
            at = self._think(first, self._within, until)
        except (LateError, ThinkingFailedError):
            return None
        return ends[at] if type(at) is int and 0 <= at < len(ends) else None

    def _think(self, job: Callable[[], Any], within: float, until: float) -> Any:
        """What `job` comes to, in the time that the site allows by now."""
        allowed = min(within, float(self._runtime.site.limits.planning))
        return Beside(self._runtime, allowed, until)(job)
