"""Goals of `/aeros/execute_skill` become steps of the executor, which has every action of them decided.

Whoever owns the executor calls `serve_goals`, in the thread in which steps go on; nobody else starts any
meanwhile.  Goals that come beside each other run beside each other, as far as their resources allow.
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
"""Goals at a time; each may have a process of its own.  Others wait, and the server refuses too many."""

_TURN_S: Final = 0.05  # plant seconds after which cancellations and new goals are looked at again
_POLL_INTERVAL_S: Final = 0.05  # s, while there is no goal


class SteppableRuntime(Runtime, Protocol):
    """A runtime that can be looked at between whatever it does; `Executor` is one."""

    def advance_once(self, until: float) -> EndedStep | None:
        """Let one thing happen, or time go on until `until`, in plant seconds; a step that has ended."""

    def decision_counts(self, step: StepHandle) -> DecisionCounts | None:
        """What was decided of a step so far; None once it has ended."""


def serve_goals(server: Server, runtime: SteppableRuntime, is_over: Callable[[], bool]) -> None:
    """Pursue the goals of `server` until `is_over`, then cancel what is left, and close it.

    A goal succeeds where its skill finishes, is canceled where that was asked for and done, and is aborted
    otherwise; `status` and `reason` of the result say how the step ended.  What `runtime` raises goes
    through, and aborts every goal.
    """
    pursuit = _GoalRunner(runtime)
    try:
        while not is_over():
            if len(pursuit.goals) < MAX_GOALS:
                goal = server.next_goal(0.0 if pursuit.goals else _POLL_INTERVAL_S)
                if goal is not None:
                    pursuit.start_goal(goal)
            pursuit.cancel_requested()
            pursuit.advance()
        pursuit.cancel_all()
        while pursuit.goals:
            pursuit.advance()
    finally:
        server.close()


class _MalformedError(Exception):
    """The inputs of a goal are none; the message says why."""


@dataclass
class _ActiveGoal:
    """A goal whose step is under way, and what was told of it."""

    goal: Goal
    feedback_sent: DecisionCounts = field(default_factory=DecisionCounts)


class _GoalRunner:
    """The goals under way, by their steps."""

    def __init__(self, runtime: SteppableRuntime) -> None:
        self.goals: dict[StepHandle, _ActiveGoal] = {}
        self._runtime = runtime

    def start_goal(self, goal: Goal) -> None:
        """Start its step, or say why there is none."""
        asked = goal.goal
        try:
            inputs = _parse_inputs(asked.inputs)
        except _MalformedError as wrong:
            refusal = {"module": asked.module, "skill": asked.skill, "reason": str(wrong)}
            self._runtime.note("goal-refused", refusal)
            _finish_goal(goal, StepResult(StepStatus.REFUSED, str(wrong)))
            return
        started = self._runtime.start(StepRequest(asked.module, asked.skill, inputs))
        if isinstance(started, StepResult):
            _finish_goal(goal, started)
        else:
            self.goals[started] = _ActiveGoal(goal)

    def cancel_requested(self) -> None:
        """Cancel what whoever wants it does not want any more."""
        for step, pursued in self.goals.items():
            if pursued.goal.status is GoalStatus.CANCELING:
                self._runtime.cancel(step, "whoever had asked for it cancels it")

    def cancel_all(self) -> None:
        """Cancel whatever is under way."""
        for step in self.goals:
            self._runtime.cancel(step, "whoever pursues it ends")

    def advance(self) -> None:
        """Let steps go on for a turn; tell how they go, and the result of one that has ended."""
        if not self.goals:
            return
        ended = self._runtime.advance_once(self._runtime.now() + _TURN_S)
        if ended is not None:
            _finish_goal(self.goals.pop(ended.step).goal, ended.result)
        for step, pursued in self.goals.items():
            counts = self._runtime.decision_counts(step)
            if counts is not None and counts != pursued.feedback_sent:
                pursued.feedback_sent = counts
                pursued.goal.send_feedback(
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
    """A JSON object, no name of it twice; of which types its values have to be, the skill declares."""
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
    found = dict(pairs)
    if len(found) < len(pairs):
        raise _MalformedError("an input is given twice")
    return found


def _reject_constant(text: str) -> None:
    raise _MalformedError(f"`{text}` is no number of JSON")
