"""The MCP tools of an untrusted client.  No tool bypasses the gate.

Tools that let the robot move wait for the operator's approval, unless the site exempts plans; tools that stop
it do not wait.  After a pause or a stop by anyone, nothing is executed until the operator resumes.  A client
may request a resume, which the operator approves.
"""

from __future__ import annotations

import hashlib
import json
import secrets
import threading
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from aeros.agent.planning.routing import RoutedTask
from aeros.agent.world.values import effects_for_reading, to_json_value
from aeros.agent.world.world import WorldModel, world_from_readings
from aeros.apps.goal import parse_goal
from aeros.apps.mcp.approvals import Approval, ApprovalError, Approvals
from aeros.apps.mcp.plan_review import ClientPlan
from aeros.apps.mcp.robot import LatestMeasurements, McpRobotThread, PlanExecution, RobotParts
from aeros.apps.mcp.tool_arguments import (
    ToolCallError,
    check_call,
    read_seconds,
    read_steps,
    read_text,
)
from aeros.runtime.execution.governor import OperatorCommand
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.diagnostics.render import render_all
from aeros.spec.expr.types import RealType, VectorType
from aeros.spec.model.ecm import ActionCondition, Ecm
from aeros.spec.model.policy import Execute
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared

MAX_PLANS: Final = 32

DESCRIPTIONS: Final = {
    "list_skills": "Skills that plans may use, with preconditions, outcomes and inputs; and the task's goal.",
    "state": "Current measurements with ages, running plan, pause/stop state, pending approvals.",
    "propose_plan": "Check a plan. Returns an id if accepted, otherwise the problems. Nothing moves.",
    "execute_plan": "Execute an accepted plan, once. Unless the site says otherwise the operator must "
    "approve first; then call again. Returns at once, or after `wait` seconds; `state` shows the progress.",
    "pause": "Pause: no new action starts; running motions finish.",
    "stop": "Stop all motion and end the plan.",
    "resume": "Request the operator's approval to let actions start again.",
}


@dataclass(slots=True)
class _AcceptedPlan:
    """An accepted plan, and the id of its request for approval."""

    plan: ClientPlan
    approval: str | None = None


class Tools:
    """All tools of one server.

    Args:
        robot: Thread of the robot.
        measurements: Latest measurements, for calls while a plan is executed.
        routed: The task that the robot is set up for.
        approvals: Requests to the operator.
        ask: Requests an operator command and returns when it is in effect.
        command: Returns the command in force.
    """

    def __init__(
        self,
        robot: McpRobotThread,
        measurements: LatestMeasurements,
        routed: RoutedTask,
        approvals: Approvals,
        ask: Callable[[OperatorCommand], None],
        command: Callable[[], OperatorCommand],
    ) -> None:
        self._robot = robot
        self._measurements = measurements
        self._routed = routed
        self._approvals = approvals
        self._ask = ask
        self._command = command
        self._plans: dict[str, _AcceptedPlan] = {}
        self._resuming: str | None = None
        self._site, self._modules = robot.call(_current_configuration).result()
        # Calls come in several threads; the lock is never held while one waits for the robot.
        self._lock = threading.Lock()

    def call(self, tool: str, arguments: Mapping[str, Any], client: str) -> dict[str, Any]:
        """Call a tool.

        Args:
            tool: Name of the tool.
            arguments: The client's arguments.
            client: The client's name, as it gives it.

        Returns:
            The answer, JSON values.

        Raises:
            ToolCallError: The call is rejected; the rejection is recorded in the audit log.
        """
        try:
            check_call(tool, arguments)
            does = {
                "list_skills": self._list_skills,
                "state": self._state,
                "propose_plan": self._propose,
                "execute_plan": self._execute,
                "pause": self._pause,
                "stop": self._stop,
                "resume": self._resume,
            }
            return does[tool](arguments, client)
        except (ToolCallError, ApprovalError) as refusal:
            self._record("mcp-call-rejected", {"client": client, "tool": tool[:80], "reason": str(refusal)})
            raise ToolCallError(str(refusal)) from refusal

    # Queries

    def _list_skills(self, _arguments: Mapping[str, Any], _client: str) -> dict[str, Any]:
        self._apply_configuration()
        allowed = self._site.mcp.skills
        task = self._routed.task
        return {
            "task": {"name": str(self._routed), "goal": task.goal_text, "words": list(task.trigger_phrases)},
            "most_steps": self._site.mcp.max_steps,
            "skills": [
                one
                for module in self._modules.values()
                for one in _skills(module)
                if allowed is None or one["skill"] in allowed
            ],
        }

    def _state(self, _arguments: Mapping[str, Any], _client: str) -> dict[str, Any]:
        if self._robot.is_busy:
            now, readings = self._measurements.last()
            world = world_from_readings(self._site.state, readings, now)
        else:
            world = self._robot.world().result()
        return {
            "time": world.time,
            "state": dict(_world_json(world)),
            "operator": self._command().name.lower(),
            "running": None if self._robot.running is None else _progress(self._robot.running),
            "plans": list(self._plans),
            "waiting_for_approval": self._approvals.pending,
        }

    # Plans

    def _propose(self, arguments: Mapping[str, Any], client: str) -> dict[str, Any]:
        self._require_idle()
        self._apply_configuration()
        steps = read_steps(arguments, self._site.mcp.max_steps)
        goal = self._goal(read_text(arguments, "goal"))
        plan = ClientPlan(steps, goal)

        def judge(parts: RobotParts) -> tuple[WorldModel, list[str]]:
            runtime = parts.runtime
            world = world_from_readings(runtime.site.state, runtime.observe(), runtime.now())
            judge = parts.planner.judge
            return world, judge.problems(plan, self._routed, world, runtime.active_modules())

        world, problems = self._robot.call(judge).result()
        name = None
        if not problems:
            name = secrets.token_hex(4)
            with self._lock:
                while len(self._plans) >= MAX_PLANS:
                    self._discard_plan(next(iter(self._plans)))
                self._plans[name] = _AcceptedPlan(plan)
        verdict = {"accepted": not problems, "plan": name, "problems": problems}
        self._record("mcp-plan-proposed", {"client": client, **verdict, **_content(plan)})
        measured = {one: to_json_value(world.known[one]) for one in world.predicates if one in world.known}
        return {**verdict, "goal": goal.text, "judged_from": measured}

    def _execute(self, arguments: Mapping[str, Any], client: str) -> dict[str, Any]:
        name, wait = read_text(arguments, "plan"), read_seconds(arguments, "wait")
        self._apply_configuration()
        with self._lock:
            execution = self._begin(name or "", client)
        if not isinstance(execution, PlanExecution):
            return execution
        execution.ended.wait(wait)
        return _progress(execution)

    def _begin(self, name: str, client: str) -> PlanExecution | dict[str, Any]:
        """Return the execution of a plan, started now or before, or an answer that names the request.

        Raises:
            ToolCallError: The plan is unknown, may not be executed, or the robot is held.
        """
        running = self._robot.running
        if running is not None and name == running.plan:
            return running
        kept = self._plans.get(name)
        if kept is None:
            raise ToolCallError("unknown plan; call propose_plan first")
        self._require_idle()
        if self._site.mcp.execute is Execute.DENIED:
            raise ToolCallError("this site does not allow MCP clients to execute plans")
        if self._command() is not OperatorCommand.RUN:
            raise ToolCallError(f"{self._hold_reason()}: the operator resumes it with `aeros resume`")
        approval = None
        if self._site.mcp.execute is Execute.APPROVAL:
            approval = self._approvals.consume(kept.approval)
            if approval is None:
                return self._wait_for_approval(name, kept, client)
        del self._plans[name]
        return self._robot.start_plan(
            name, kept.plan, self._start_execution(client, name, kept.plan, approval)
        )

    def _wait_for_approval(self, name: str, kept: _AcceptedPlan, client: str) -> dict[str, Any]:
        if self._approvals.is_rejected(kept.approval):
            self._discard_plan(name)
            raise ToolCallError("the operator did not approve it; propose a plan again")
        what = {"what": "execute", "client": client, "plan": name, **_content(kept.plan)}
        kept.approval = self._approvals.request(what, kept.approval)
        return {"status": "waits for approval", "plan": name, "operator": f"aeros approve {kept.approval}"}

    def _start_execution(
        self, client: str, name: str, plan: ClientPlan, approval: Approval | None
    ) -> Mapping[str, Any]:
        content = _content(plan)
        digest = hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
        approved = (
            None
            if approval is None
            else {"id": approval.id, "by": approval.approved_by, "at": approval.approved_at}
        )
        return {"client": client, "plan": name, "digest": digest, "approved": approved, **content}

    def _discard_plan(self, name: str) -> None:
        kept = self._plans.pop(name)
        if kept.approval is not None:
            self._approvals.withdraw(kept.approval)

    def _goal(self, text: str | None) -> ActionCondition:
        task = self._routed.task
        if text is None:
            return ActionCondition(task.goal, task.goal_text, task.span)
        try:
            return parse_goal(text, self._site)
        except UserError as error:
            raise ToolCallError(f"the goal is not understood:\n{render_all(error.diagnostics)}") from error

    def _apply_configuration(self) -> None:
        """Read the configuration in force, unless a plan is executed."""
        if not self._robot.is_busy:
            self._site, self._modules = self._robot.call(_current_configuration).result()

    def _require_idle(self) -> None:
        if self._robot.is_busy and self._robot.running is not None:
            raise ToolCallError(f"the robot is busy with plan {self._robot.running.plan}")

    # Pause, stop, resume

    def _pause(self, _arguments: Mapping[str, Any], client: str) -> dict[str, Any]:
        if self._command() is OperatorCommand.RUN:
            self._ask(OperatorCommand.PAUSE)
        self._record("mcp-paused", {"client": client})
        return {"status": self._hold_reason()}

    def _stop(self, _arguments: Mapping[str, Any], client: str) -> dict[str, Any]:
        self._ask(OperatorCommand.STOP)
        with self._lock:
            for name in list(self._plans):
                self._discard_plan(name)
            self._approvals.withdraw_all()
        self._record("mcp-stopped", {"client": client})
        return {"status": self._hold_reason()}

    def _resume(self, _arguments: Mapping[str, Any], client: str) -> dict[str, Any]:
        if self._command() is OperatorCommand.RUN:
            return {"status": "the robot is neither paused nor stopped"}
        if self._robot.is_busy and self._command() is OperatorCommand.STOP:
            raise ToolCallError("the plan that was stopped has not ended yet")
        with self._lock:
            approval = self._approvals.consume(self._resuming)
            if approval is None:
                known = None if self._approvals.is_rejected(self._resuming) else self._resuming
                self._resuming = self._approvals.request({"what": "resume", "client": client}, known)
                return {"status": "waits for approval", "operator": f"aeros approve {self._resuming}"}
            self._resuming = None
        self._record(
            "mcp-resumed",
            {"client": client, "approved": {"by": approval.approved_by, "at": approval.approved_at}},
        )
        self._ask(OperatorCommand.RUN)
        return {"status": "resumed"}

    def _hold_reason(self) -> str:
        return {
            OperatorCommand.RUN: "running",
            OperatorCommand.PAUSE: "paused",
            OperatorCommand.STOP: "stopped",
        }[self._command()]

    def _record(self, event: str, details: Mapping[str, Any]) -> None:
        """Append an event to the audit log; while a plan is executed, after its end."""
        self._robot.call(lambda parts: parts.runtime.note(event, details))


def _current_configuration(parts: RobotParts) -> tuple[Site, Mapping[str, Ecm]]:
    modules = parts.runtime.active_modules()
    return parts.runtime.site, modules


def _content(plan: ClientPlan) -> dict[str, Any]:
    return {
        "steps": [{"skill": s.skill, "inputs": dict(s.inputs)} for s in plan.steps],
        "goal": plan.goal.text,
    }


def _progress(running: PlanExecution) -> dict[str, Any]:
    if not running.ended.is_set():
        return {"status": "executing", "plan": running.plan}
    report = running.report
    if report is None:
        return {"status": "failed", "plan": running.plan, "reason": running.failure}
    steps = [
        {"skill": f"{s.module}.{s.skill}", "status": s.status.value, "outcome": s.outcome, "reason": s.reason}
        for s in report.steps
    ]
    status = "goal reached" if report.reached else "goal not reached"
    measured = dict(report.measured)
    return {
        "status": status,
        "plan": running.plan,
        "reason": report.reason,
        "measured": measured,
        "steps": steps,
    }


def _skills(ecm: Ecm) -> Iterator[dict[str, Any]]:
    for skill in ecm.skills.values():
        yield {
            "skill": f"{ecm.id}.{skill.id}",
            "risk": skill.risk.name.lower(),
            "precondition": None if skill.precondition is None else skill.precondition.text,
            "outcomes": [
                {"outcome": one.id, "failure": one.failure, "then": effects_for_reading(one)}
                for one in skill.outcomes.values()
            ],
            "inputs": {
                name.removeprefix("inputs."): _declared(one)
                for name, one in skill.inputs.items()
                if one.default_value is None
            },
        }


def _declared(one: Declared) -> dict[str, Any]:
    type_ = one.variable.type
    unit = str(type_.dimension) if isinstance(type_, RealType | VectorType) else None
    return {
        "type": str(type_),
        "unit": unit,
        "range": None if one.range is None else [*map(float, one.range)],
    }


def _world_json(world: WorldModel) -> Iterator[tuple[str, dict[str, Any]]]:
    for name, value in world.known.items():
        age = world.time - world.stamps[name].time
        yield name, {"value": to_json_value(value), "age": age}
    for name, why in world.unknown.items():
        yield name, {"value": None, "unknown": why}
