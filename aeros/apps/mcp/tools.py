"""The MCP tools of an untrusted client.  No tool bypasses the gate.

Tools that let the robot move wait for approval, unless the site exempts plans; tools that stop it do not
wait.  After a pause or a stop by anyone, nothing is executed until the operator resumes.  A client may
request a resume, which only the operator's terminal approves.
"""

from __future__ import annotations

import hashlib
import json
import threading
import time
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Final, TypeVar

from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.world.values import to_json_value
from aeros.agent.world.world import WorldModel, world_from_readings
from aeros.apps.goal import parse_goal
from aeros.apps.mcp.accepted_plans import AcceptedPlans
from aeros.apps.mcp.approvals import Approval, ApprovalError, Approvals
from aeros.apps.mcp.client_notes import ClientNotes
from aeros.apps.mcp.hold_tools import HOLD_WORDS, HoldTools, approval_note
from aeros.apps.mcp.plan_review import ClientPlan
from aeros.apps.mcp.robot import LatestMeasurements, McpRobotThread, PlanExecution, RobotParts
from aeros.apps.mcp.skill_listing import list_skills, list_tasks, routed_to_json, world_to_json
from aeros.apps.mcp.task_choice import TaskChoice
from aeros.apps.mcp.tool_arguments import (
    ToolCallError,
    check_call,
    read_seconds,
    read_steps,
    read_text,
)
from aeros.apps.mcp.tool_results import execution_result, pending_result
from aeros.runtime.execution.governor import OperatorCommand
from aeros.runtime.registry.control_page import MotionTimeoutError
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.diagnostics.render import render_all
from aeros.spec.model.ecm import ActionCondition, Ecm
from aeros.spec.model.policy import Execute
from aeros.spec.model.site import Site

DESCRIPTIONS: Final = {
    "list_skills": "Tasks with their goals, and skills that plans may use, with preconditions, outcomes and "
    "inputs.",
    "state": "Current measurements with ages, running plan, pause/stop state, pending approvals.",
    "propose_plan": "Check a plan. Returns an id if accepted, otherwise the problems. Nothing moves.",
    "execute_plan": "Execute an accepted plan, once. Unless the site says otherwise the operator must "
    "approve first; then call again. Returns at once, or after `wait` seconds; `state` shows the progress. "
    "Cancelling the call stops the motion.",
    "pause": "Pause: no new action starts; running motions finish.",
    "stop": "Stop all motion and end the plan.",
    "resume": "Request the operator's approval to let actions start again.",
}

_Result = TypeVar("_Result")


class Tools:
    """All tools of one server.  Calls may come from several threads and several clients.

    Args:
        robot: Thread of the robot.
        measurements: Latest measurements, for calls while a plan is executed.
        tasks: Finds the task that a plan is for.
        approvals: Requests to the operator.
        ask: Requests an operator command and returns when it is in effect.
        command: Returns the command in force.
    """

    def __init__(
        self,
        robot: McpRobotThread,
        measurements: LatestMeasurements,
        tasks: TaskChoice,
        approvals: Approvals,
        ask: Callable[[OperatorCommand], None],
        command: Callable[[], OperatorCommand],
    ) -> None:
        self.robot = robot
        self.measurements = measurements
        self._tasks = tasks
        self._approvals = approvals
        self.command = command
        self._plans = AcceptedPlans(approvals)
        self._notes = ClientNotes(self._record)
        self.site, self.modules = robot.call(_current_configuration).result()
        # The lock is never held while one waits for a plan.
        self._lock = threading.Lock()
        self._hold = HoldTools(robot, approvals, self._discard_plans, self._notes, ask, command)

    def call(self, tool: str, arguments: Mapping[str, Any], client: str) -> dict[str, Any]:
        """Call a tool; `execute_plan` blocks for `wait` seconds.

        Args:
            tool: Name of the tool.
            arguments: The client's arguments.
            client: The client's name, as it gives it.

        Returns:
            The answer, JSON values as `tool_results.OUTPUT_SCHEMAS` describes them.

        Raises:
            ToolCallError: The call is rejected; the rejection is recorded in the audit log.
        """
        does: dict[str, Callable[[Mapping[str, Any], str], dict[str, Any]]] = {
            "list_skills": self._list_skills,
            "state": self._state,
            "propose_plan": self._propose,
            "execute_plan": self._execute,
            "pause": lambda _, client: self._hold.pause(client),
            "stop": lambda _, client: self._hold.stop(client),
            "resume": lambda _, client: self._hold.resume(client),
        }
        return self._checked(tool, arguments, client, lambda: does[tool](arguments, client))

    def begin(
        self, arguments: Mapping[str, Any], client: str, answer: bool | None = None
    ) -> PlanExecution | dict[str, Any]:
        """Begin `execute_plan` without waiting for the end of the plan.

        Args:
            arguments: The client's arguments.
            client: The client's name, as it gives it.
            answer: Answer of the client's user to an elicitation, as the client says; None for none.

        Returns:
            The execution, or the result of a plan that waits for approval.

        Raises:
            ToolCallError: The call is rejected; the rejection is recorded in the audit log.
        """
        start = partial(self._start, arguments, client, answer)
        return self._checked("execute_plan", arguments, client, start)

    def cancel_unattended(self, limit_s: float) -> None:
        """Cancel the plan in execution if no client has waited for it lately.

        Args:
            limit_s: Real time since a client last waited (s).
        """
        running = self.robot.running
        if running is None or running.ended.is_set():
            return
        if time.monotonic() - running.attended_at > limit_s:
            running.cancel(f"no client has waited for the plan for {limit_s:g} s")

    def is_decided(self, plan: str) -> bool:
        """Check if the operator has approved or rejected a plan, or it is no longer kept.

        Args:
            plan: Id of the plan.

        Returns:
            True if asking somebody else is of no use.
        """
        with self._lock:
            return self._plans.is_decided(plan)

    def approval_question(self, plan: str) -> str:
        """Return the question that the client's user is asked before a plan is executed.

        Args:
            plan: Id of the plan.

        Returns:
            The text, with all steps, the task and the goal.

        Raises:
            ToolCallError: There is no such plan.
        """
        with self._lock:
            content = _content(self._plans.find(plan).plan)
        return _question(self.site.id, plan, content)

    def _checked(
        self, tool: str, arguments: Mapping[str, Any], client: str, do: Callable[[], _Result]
    ) -> _Result:
        """Check the arguments and call a tool.

        Raises:
            ToolCallError: The call is rejected; the rejection is recorded.
        """
        try:
            check_call(tool, arguments)
            return do()
        except (ToolCallError, ApprovalError, MotionTimeoutError) as refusal:
            text = str(refusal)
            if isinstance(refusal, MotionTimeoutError):
                text = f"still moving {text}; use the robot's emergency stop"
            self._notes.add("mcp-call-rejected", {"client": client, "tool": tool[:80], "reason": text})
            raise ToolCallError(text) from refusal

    # Queries

    def _list_skills(self, _arguments: Mapping[str, Any], _client: str) -> dict[str, Any]:
        self._apply_configuration()
        allowed = self.site.mcp.skills
        task = self._tasks.default
        return {
            "task": None if task is None else routed_to_json(task),
            "tasks": list_tasks(self.modules),
            "most_steps": self.site.mcp.max_steps,
            "skills": [
                one
                for module in self.modules.values()
                for one in list_skills(module)
                if allowed is None or one["skill"] in allowed
            ],
        }

    def _state(self, _arguments: Mapping[str, Any], _client: str) -> dict[str, Any]:
        if self.robot.is_busy:
            now, readings = self.measurements.last()
            world = world_from_readings(self.site.state, readings, now)
        else:
            world = self.robot.world().result()
        return {
            "time": world.time,
            "state": world_to_json(world),
            "operator": self.command().name.lower(),
            "running": None if self.robot.running is None else execution_result(self.robot.running),
            "plans": list(self._plans),
            "waiting_for_approval": self._approvals.pending,
        }

    # Plans

    def _propose(self, arguments: Mapping[str, Any], client: str) -> dict[str, Any]:
        self._require_idle()
        self._apply_configuration()
        steps = read_steps(arguments, self.site.mcp.max_steps)
        try:
            routed = self._tasks.find(read_text(arguments, "task"), self.modules)
        except InstructionError as error:
            raise ToolCallError(f"the task is not understood: {error.reason}") from error
        plan = ClientPlan(steps, _goal(read_text(arguments, "goal"), routed, self.site), routed)
        world, problems = _judged(self.robot, plan)
        name = None
        if not problems:
            with self._lock:
                name = self._plans.add(plan)
        verdict = {"accepted": not problems, "plan": name, "problems": problems}
        if not self._notes.add("mcp-plan-proposed", {"client": client, **verdict, **_content(plan)}):
            with self._lock:
                self._plans.discard_if_kept(name)
            raise ToolCallError("too many proposals and rejected calls lately; propose again in a minute")
        measured = {one: to_json_value(world.known[one]) for one in world.predicates if one in world.known}
        return {**verdict, "task": str(routed), "goal": plan.goal.text, "judged_from": measured}

    def _execute(self, arguments: Mapping[str, Any], client: str) -> dict[str, Any]:
        started = self._start(arguments, client, None)
        if not isinstance(started, PlanExecution):
            return started
        started.ended.wait(read_seconds(arguments, "wait"))
        return execution_result(started)

    def _start(
        self, arguments: Mapping[str, Any], client: str, answer: bool | None
    ) -> PlanExecution | dict[str, Any]:
        read_seconds(arguments, "wait")
        self._apply_configuration()
        with self._lock:
            return self._begin(read_text(arguments, "plan") or "", client, answer)

    def _begin(self, name: str, client: str, answer: bool | None) -> PlanExecution | dict[str, Any]:
        """Return the execution of a plan, started now or before, or an answer that names the request.

        Raises:
            ToolCallError: The plan is unknown, may not be executed, or the robot is held.
        """
        running = self.robot.running
        if running is not None and name == running.plan:
            return running
        kept = self._plans.find(name)
        self._require_idle()
        execute = self.site.mcp.execute
        if execute is Execute.DENIED:
            raise ToolCallError("this site does not allow MCP clients to execute plans")
        if self.command() is not OperatorCommand.RUN:
            held = HOLD_WORDS[self.command()]
            raise ToolCallError(f"{held}: the operator resumes it with `aeros resume`")
        approval = None
        if execute is not Execute.ALLOWED:
            approval = self._plans.approval_of(kept, execute, client, answer)
            if approval is None:
                what = {"what": "execute", "client": client, "plan": kept.id, **_content(kept.plan)}
                request = self._plans.request_approval(kept, what)
                return pending_result(name, request, user_may_approve=execute is Execute.ELICITATION)
        self._plans.take(name)
        return self.robot.start_plan(name, kept.plan, _start_note(client, name, kept.plan, approval))

    def _apply_configuration(self) -> None:
        """Read the configuration in force, unless a plan is executed."""
        if not self.robot.is_busy:
            self.site, self.modules = self.robot.call(_current_configuration).result()

    def _discard_plans(self) -> None:
        with self._lock:
            self._plans.discard_all()

    def _require_idle(self) -> None:
        if self.robot.is_busy and self.robot.running is not None:
            raise ToolCallError(f"the robot is busy with plan {self.robot.running.plan}")

    def _record(self, event: str, details: Mapping[str, Any]) -> None:
        """Append an event to the audit log; while a plan is executed, after its end."""
        self.robot.call(lambda parts: parts.runtime.note(event, details))


def _judged(robot: McpRobotThread, plan: ClientPlan) -> tuple[WorldModel, list[str]]:
    """Check a plan in the robot's thread, from the state that is measured now."""

    def judge(parts: RobotParts) -> tuple[WorldModel, list[str]]:
        runtime = parts.runtime
        world = world_from_readings(runtime.site.state, runtime.observe(), runtime.now())
        return world, parts.planner.judge.problems(plan, plan.routed, world, runtime.active_modules())

    return robot.call(judge).result()


def _current_configuration(parts: RobotParts) -> tuple[Site, Mapping[str, Ecm]]:
    modules = parts.runtime.active_modules()
    return parts.runtime.site, modules


def _goal(text: str | None, routed: RoutedTask, site: Site) -> ActionCondition:
    task = routed.task
    if text is None:
        return ActionCondition(task.goal, task.goal_text, task.span)
    try:
        return parse_goal(text, site)
    except UserError as error:
        raise ToolCallError(f"the goal is not understood:\n{render_all(error.diagnostics)}") from error


def _question(robot: str, plan: str, content: Mapping[str, Any]) -> str:
    steps = (
        f"{number}. {step['skill']}" + (f" {json.dumps(step['inputs'])}" if step["inputs"] else "")
        for number, step in enumerate(content["steps"], 1)
    )
    asked = f"Robot `{robot}` will move if you agree.  Task {content['task']}, plan {plan}:"
    return "\n".join([asked, *steps, f"until {content['goal']}"])


def _content(plan: ClientPlan) -> dict[str, Any]:
    return {
        "task": plan.routed.formal_text,
        "steps": [{"skill": s.skill, "inputs": dict(s.inputs)} for s in plan.steps],
        "goal": plan.goal.text,
    }


def _start_note(client: str, name: str, plan: ClientPlan, approval: Approval | None) -> dict[str, Any]:
    content = _content(plan)
    digest = hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
    approved = None if approval is None else {"id": approval.id, **approval_note(approval)}
    return {"client": client, "plan": name, "digest": digest, "approved": approved, **content}
