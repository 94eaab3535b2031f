"""The robot behind the MCP tools: one thread opens it, uses it for one call at a time, and closes it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

from aeros.agent.agent import Agent
from aeros.agent.execution.journal import AgentEvent
from aeros.agent.execution.report import RunReport
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import TaskGraph
from aeros.agent.world.world import WorldModel, world_from_readings
from aeros.apps.mcp.plan_review import ClientPlan, ClientPlanChecker
from aeros.runtime.bus.message_publisher import RobotChain
from aeros.runtime.ports import Reading, Readings, Runtime
from aeros.session.robot_thread import RobotThread
from aeros.spec.model.ecm import Ecm

_STEP_EVENTS: Final = frozenset(("step-started", "step-ended"))


class PlanWithdrawnError(Exception):
    """A client's plan that is not executed or not continued; the message says why."""


class ClientPlanner:
    """A `Planner` that proposes the client's plan once, if it is still accepted in the current state.

    Args:
        judge: Checks the plan again before it starts.

    Attributes:
        plan_to_follow: The plan to propose next; None for none.
    """

    name = "mcp"

    def __init__(self, judge: ClientPlanChecker) -> None:
        self.judge = judge
        self.plan_to_follow: ClientPlan | None = None

    def plan(self, routed: RoutedTask, world: WorldModel, modules: Mapping[str, Ecm]) -> TaskGraph:
        """Implement `Planner.plan`.

        Raises:
            PlanWithdrawnError: There is no plan, or it is not accepted in the current state.
        """
        plan, self.plan_to_follow = self.plan_to_follow, None
        if plan is None:
            raise PlanWithdrawnError("the plan has ended; propose a new one")
        problems = self.judge.problems(plan, routed, world, modules)
        if problems:
            raise PlanWithdrawnError("no longer valid in the current state: " + "; ".join(problems))
        return plan.graph


class RobotParts(NamedTuple):
    """Parts of the robot that only its thread uses.

    Attributes:
        runtime: The runtime that runs steps.
        agent: The agent that pursues tasks.
        planner: The planner that hands the client's plan to the agent.
    """

    runtime: Runtime
    agent: Agent
    planner: ClientPlanner


@dataclass(slots=True)
class PlanExecution:
    """A plan in execution, or after it.

    Attributes:
        plan: Id of the plan.
        client: The client that started it, by the name that it gives itself.
        step_count: Number of its steps.
        report: The agent's report; None while it runs or after an exception.
        failure: Text of the exception that ended it; None if there was none.
        ended: Set when the execution has ended.
        cancel_reason: Text once it is cancelled; None before.
        attended_at: Real time at which a client last waited for it (s), of `time.monotonic`.
        progress: Steps that have ended, plus a half for each that has begun, and text of the latest event.
    """

    plan: str
    client: str = ""
    step_count: int = 0
    report: RunReport | None = None
    failure: str | None = None
    ended: threading.Event = field(default_factory=threading.Event)
    cancel_reason: str | None = None
    attended_at: float = field(default_factory=time.monotonic)
    progress: tuple[float, str] = (0.0, "")

    def on_event(self, event: AgentEvent) -> None:
        """Count a step that begins or ends.

        Args:
            event: An event of the agent.
        """
        if event.kind in _STEP_EVENTS:
            self.progress = self.progress[0] + 0.5, event.text

    def cancel(self, reason: str) -> None:
        """Bring the motion to rest and end the plan; any thread may call it, the first reason stays.

        Args:
            reason: Text for report and audit log.
        """
        if self.cancel_reason is None:
            self.cancel_reason = reason


class LatestMeasurements:
    """Latest measurements, for threads that cannot query the plant: a `MeasurementListener`."""

    def __init__(self) -> None:
        self._readings: dict[str, Reading] = {}
        self._now = 0.0
        self._lock = threading.Lock()

    def on_tick(self, now: float, values: Mapping[str, Any], chain: RobotChain) -> None:
        """Implement `MeasurementListener.on_tick`."""
        read = {n: value if type(value) is Reading else Reading(value, now) for n, value in values.items()}
        with self._lock:
            self._readings |= read
            self._now = now

    def on_observed(self, readings: Readings, chain: RobotChain) -> None:
        """Implement `MeasurementListener.on_observed`."""
        with self._lock:
            self._readings |= readings

    def last(self) -> tuple[float, Readings]:
        """Return the latest measurements.

        Returns:
            Plant time of the last control tick (s), and the latest reading of each variable.
        """
        with self._lock:
            return self._now, dict(self._readings)


class McpEvents:
    """Events of the agent for the plan in execution, and that plan's cancellation for the agent.

    Attributes:
        robot: The robot's thread; None until it runs.
    """

    def __init__(self) -> None:
        self.robot: McpRobotThread | None = None

    def on_event(self, event: AgentEvent) -> None:
        """Pass an event of the agent to the plan in execution.

        Args:
            event: The event.
        """
        running = self._running()
        if running is not None:
            running.on_event(event)

    def cancel_reason(self) -> str | None:
        """Return the reason for which the plan in execution is cancelled.

        Returns:
            The text; None if it is not cancelled, or nothing is executed.
        """
        running = self._running()
        return None if running is None else running.cancel_reason

    def _running(self) -> PlanExecution | None:
        running = None if self.robot is None else self.robot.running
        return None if running is None or running.ended.is_set() else running


class McpRobotThread(RobotThread[RobotParts]):
    """Robot thread that executes plans of clients.

    Args:
        open_parts: Context manager of the robot's parts; it is entered and left in the thread.
        halt: Stops all motion permanently.

    Attributes:
        running: The plan in execution or the last one; None before the first.
    """

    def __init__(
        self,
        open_parts: Callable[[], AbstractContextManager[RobotParts]],
        halt: Callable[[], None],
    ) -> None:
        self._halt = halt
        self.running: PlanExecution | None = None
        super().__init__(open_parts)

    @property
    def is_busy(self) -> bool:
        """True while a plan is executed."""
        return self.running is not None and not self.running.ended.is_set()

    def world(self) -> Future[WorldModel]:
        """Measure the state.

        Returns:
            A future of the measured state.
        """

        def look(parts: RobotParts) -> WorldModel:
            runtime = parts.runtime
            return world_from_readings(runtime.site.state, runtime.observe(), runtime.now())

        return self.call(look)

    def start_plan(self, name: str, plan: ClientPlan, details: Mapping[str, Any]) -> PlanExecution:
        """Start the execution of a plan.

        Args:
            name: Id of the plan.
            plan: The plan.
            details: Details of the audit record `mcp-plan-started`: client, plan and approval.

        Returns:
            The execution, which goes on in the thread.
        """
        running = self.running = PlanExecution(name, str(details.get("client", "")), len(plan.steps))

        def follow(parts: RobotParts) -> None:
            try:
                parts.runtime.note("mcp-plan-started", details)
                parts.planner.plan_to_follow = plan
                running.report = parts.agent.run(plan.routed.instruction, goal=plan.goal)
            except BaseException as failure:
                running.failure = f"{type(failure).__name__}: {failure}"
                raise
            finally:
                try:
                    if running.cancel_reason is not None:
                        cancelled = {"plan": name, "reason": running.cancel_reason}
                        parts.runtime.note("mcp-plan-cancelled", cancelled)
                finally:
                    running.ended.set()

        self.call(follow)
        return running

    def close(self) -> None:
        """Stop all motion and end the thread; safe to call twice."""
        self._halt()
        super().close()
