"""Action server of `/aeros/execute_skill`: each goal becomes a step of the executor.

So the gate decides every action of a goal. The executor's owner calls `serve_goals` in the thread that runs
the steps; nobody else starts steps meanwhile. Concurrent goals run concurrently, as far as their resources
allow.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final, Protocol

from aeros.runtime.audit.log import DecisionCounts
from aeros.runtime.bus.messages import ExecuteSkillFeedback, ExecuteSkillGoal, ExecuteSkillResult
from aeros.runtime.bus.port import ActionServer, GoalStatus, ServerGoal
from aeros.runtime.canonical_json import to_canonical_json
from aeros.runtime.ports import EndedStep, Runtime, StepHandle, StepRequest, StepResult, StepStatus

EXECUTE_SKILL: Final = "/aeros/execute_skill"
EXECUTE: Final = (ExecuteSkillGoal, ExecuteSkillFeedback, ExecuteSkillResult)

Server = ActionServer[ExecuteSkillGoal, ExecuteSkillFeedback, ExecuteSkillResult]
Goal = ServerGoal[ExecuteSkillGoal, ExecuteSkillFeedback, ExecuteSkillResult]

MAX_GOALS: Final = 8
"""Limit on active goals; each may have a process of its own.  More wait, and the server refuses too many."""

_TURN_S: Final = 0.05  # plant seconds between checks for cancellations and new goals
_POLL_INTERVAL_S: Final = 0.05  # s, while there is no goal


class SteppableRuntime(Runtime, Protocol):
    """Runtime that returns to its caller between steps' actions; `Executor` is one."""

    def advance_once(self, until: float) -> EndedStep | None:
        """Let one skill act, or advance time.

        Args:
            until: latest time to advance to, plant seconds.

        Returns:
            A step that has ended; None if none has.
        """

    def decision_counts(self, step: StepHandle) -> DecisionCounts | None:
        """Return the counts of decisions on an active step.

        Args:
            step: the step.

        Returns:
            Numbers of allowed, attenuated and denied actions so far; None once the step has ended.
        """


def serve_goals(server: Server, runtime: SteppableRuntime, is_over: Callable[[], bool]) -> None:
    """Serve goals until `is_over`, then cancel the active ones and close the server.

    A goal succeeds if its skill finishes, is canceled if the client asked for that and it was done, and is
    aborted otherwise; `status` and `reason` of the result say how the step ended. An exception of `runtime`
    propagates and aborts every goal.

    Args:
        server: server of `/aeros/execute_skill`.
        runtime: runs the steps.
        is_over: asked in every turn.
    """
    goals = SkillGoals(server, runtime)
    try:
        while not is_over():
            goals.take_turn(_POLL_INTERVAL_S)
        goals.cancel_all()
    finally:
        server.close()


class _MalformedError(Exception):
    """The inputs of a goal are malformed; the message says how."""


@dataclass
class _ActiveGoal:
    """Goal whose step is active, and the latest feedback sent."""

    goal: Goal
    feedback_sent: DecisionCounts = field(default_factory=DecisionCounts)


class SkillGoals:
    """Active goals, by their steps; `serve_goals` shows its use.

    Args:
        server: server of `/aeros/execute_skill`.
        runtime: runs the steps.
    """

    def __init__(self, server: Server, runtime: SteppableRuntime) -> None:
        self._goals: dict[StepHandle, _ActiveGoal] = {}
        self._server = server
        self._runtime = runtime

    @property
    def is_busy(self) -> bool:
        """True while a goal is active."""
        return bool(self._goals)

    def take_turn(self, timeout: float) -> None:
        """Accept a goal, cancel what clients cancelled, and run the steps for one turn.

        Args:
            timeout: s of real time to wait for a goal if none is active.
        """
        if len(self._goals) < MAX_GOALS:
            goal = self._server.next_goal(0.0 if self._goals else timeout)
            if goal is not None:
                self._start_goal(goal)
        for step, active in self._goals.items():
            if active.goal.status is GoalStatus.CANCELING:
                self._runtime.cancel(step, "cancelled by the client")
        self._advance()

    def cancel_all(self) -> None:
        """Cancel all active steps and wait for their ends."""
        for step in self._goals:
            self._runtime.cancel(step, "the action server is closing")
        while self._goals:
            self._advance()

    def _start_goal(self, goal: Goal) -> None:
        """Start the step of a goal; if it is refused, end the goal with the reason."""
        request = goal.goal
        try:
            inputs = _parse_inputs(request.inputs)
        except _MalformedError as wrong:
            refusal = {"module": request.module, "skill": request.skill, "reason": str(wrong)}
            self._runtime.note("goal-rejected", refusal)
            _finish_goal(goal, StepResult(StepStatus.REFUSED, str(wrong)))
            return
        if goal.requesters:
            clients = [one._asdict() for one in goal.requesters]
            asked = {"module": request.module, "skill": request.skill, "clients": clients}
            self._runtime.note("goal-requested", asked)
        started = self._runtime.start(StepRequest(request.module, request.skill, inputs))
        if isinstance(started, StepResult):
            _finish_goal(goal, started)
        else:
            self._goals[started] = _ActiveGoal(goal)

    def _advance(self) -> None:
        """Run steps for one turn; send feedback, and the result of a step that has ended."""
        if not self._goals:
            return
        ended = self._runtime.advance_once(self._runtime.now() + _TURN_S)
        if ended is not None:
            _finish_goal(self._goals.pop(ended.step).goal, ended.result)
        for step, active in self._goals.items():
            counts = self._runtime.decision_counts(step)
            if counts is not None and counts != active.feedback_sent:
                active.feedback_sent = counts
                active.goal.send_feedback(
                    ExecuteSkillFeedback(counts.allowed, counts.attenuated, counts.denied)
                )


def _finish_goal(goal: Goal, result: StepResult) -> None:
    status = GoalStatus.ABORTED
    if result.status is StepStatus.FINISHED:
        status = GoalStatus.SUCCEEDED
    elif result.status is StepStatus.CANCELLED and goal.status is GoalStatus.CANCELING:
        status = GoalStatus.CANCELED
    counts = (result.allowed, result.attenuated, result.denied)
    outputs = to_canonical_json(dict(result.outputs)).decode()
    goal.set_result(status, ExecuteSkillResult(result.status.value, result.reason, outputs, *counts))


def _parse_inputs(text: str) -> dict[str, Any]:
    """Parse a JSON object without duplicate keys; the skill's declaration gives the types of its values.

    Raises:
        _MalformedError: the text is not such an object.
    """
    try:
        inputs = json.loads(text, object_pairs_hook=_reject_duplicate_keys, parse_constant=_reject_constant)
    except RecursionError:
        raise _MalformedError("the inputs are nested too deeply") from None
    except ValueError as wrong:
        raise _MalformedError(f"the inputs are not JSON: {wrong}") from None
    if type(inputs) is not dict:
        raise _MalformedError("the inputs are not a JSON object")
    return inputs


def _reject_duplicate_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    inputs = dict(pairs)
    if len(inputs) < len(pairs):
        raise _MalformedError("an input is given twice")
    return inputs


def _reject_constant(text: str) -> None:
    raise _MalformedError(f"`{text}` is not a JSON number")
