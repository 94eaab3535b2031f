"""The one robot behind the tools: all that acts lives in one thread, and does one thing at a time."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from aeros.agent.agent import Agent
from aeros.agent.execution.report import RunReport
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import TaskGraph
from aeros.agent.world.world import WorldModel, world_from_readings
from aeros.apps.mcp.plan_review import ClientPlan, ClientPlanChecker
from aeros.runtime.bus.message_publisher import RobotChain
from aeros.runtime.ports import Reading, Readings, Runtime
from aeros.session.robot_thread import RobotThread
from aeros.spec.model.model import Ecm


class PlanWithdrawnError(Exception):
    """The client's plan is not to be followed (any more); the message says why."""


class ClientPlanner:
    """A `Planner` that proposes what the client did, once, and only where it is still accepted."""

    name = "mcp"

    def __init__(self, judge: ClientPlanChecker) -> None:
        self.judge = judge
        self.plan_to_follow: ClientPlan | None = None

    def plan(self, routed: RoutedTask, world: WorldModel, modules: Mapping[str, Ecm]) -> TaskGraph:
        """See `Planner`; raises `PlanWithdrawnError`."""
        plan, self.plan_to_follow = self.plan_to_follow, None
        if plan is None:
            raise PlanWithdrawnError("the client's plan is over; it may propose another")
        problems = self.judge.problems(plan, routed, world, modules)
        if problems:
            raise PlanWithdrawnError("not accepted as things are now: " + "; ".join(problems))
        return plan.graph


class RobotParts(NamedTuple):
    """What lives in the robot's thread."""

    runtime: Runtime
    agent: Agent
    planner: ClientPlanner


@dataclass(slots=True)
class PlanExecution:
    """A plan that is executed, or was: how it ended is in `report`, or in `failure`."""

    plan: str
    report: RunReport | None = None
    failure: str | None = None
    ended: threading.Event = field(default_factory=threading.Event)


class LatestMeasurements:
    """What was measured last, for whoever may not ask the plant: a `MeasurementListener`."""

    def __init__(self) -> None:
        self._readings: dict[str, Reading] = {}
        self._now = 0.0
        self._lock = threading.Lock()

    def on_tick(self, now: float, values: Mapping[str, Any], chain: RobotChain) -> None:
        """See `MeasurementListener`."""
        read = {n: value if type(value) is Reading else Reading(value, now) for n, value in values.items()}
        with self._lock:
            self._readings |= read
            self._now = now

    def on_observed(self, readings: Readings, chain: RobotChain) -> None:
        """See `MeasurementListener`."""
        with self._lock:
            self._readings |= readings

    def last(self) -> tuple[float, Readings]:
        """The time of the last tick, and what is known since."""
        with self._lock:
            return self._now, dict(self._readings)


class McpRobotThread(RobotThread[RobotParts]):
    """Runs what it is given in a thread of its own, in which `open_parts` is entered and left.

    instruction: names the task that the robot is set up for.
    halt: has whatever moves stopped, for good.
    """

    def __init__(
        self,
        open_parts: Callable[[], AbstractContextManager[RobotParts]],
        instruction: str,
        halt: Callable[[], None],
    ) -> None:
        self._instruction = instruction
        self._halt = halt
        self.running: PlanExecution | None = None
        super().__init__(open_parts)

    @property
    def is_busy(self) -> bool:
        """Whether a plan is being executed."""
        return self.running is not None and not self.running.ended.is_set()

    def world(self) -> Future[WorldModel]:
        """What is measured now."""

        def look(parts: RobotParts) -> WorldModel:
            runtime = parts.runtime
            return world_from_readings(runtime.site.state, runtime.observe(), runtime.now())

        return self.call(look)

    def start_plan(self, name: str, plan: ClientPlan, told: Mapping[str, Any]) -> PlanExecution:
        """Begin to follow the plan; `told` is what the record says of who asked."""
        running = self.running = PlanExecution(name)

        def follow(parts: RobotParts) -> None:
            try:
                parts.runtime.note("mcp-executing", told)
                parts.planner.plan_to_follow = plan
                running.report = parts.agent.run(self._instruction, goal=plan.goal)
            except BaseException as failure:
                running.failure = f"{type(failure).__name__}: {failure}"
                raise
            finally:
                running.ended.set()

        self.call(follow)
        return running

    def close(self) -> None:
        """Stop what moves, and end; safe to call twice."""
        self._halt()
        super().close()
