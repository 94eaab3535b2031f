"""Goals of `/aeros/execute_skill` become steps of the executor, which has every action of them decided.

Whoever owns the executor calls `pursue`, in the thread in which steps go on; nobody else starts any
meanwhile.  Goals that come beside each other run beside each other, as far as their resources allow.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final, Protocol

from aeros.runtime.audit.log import DecisionCounts
from aeros.runtime.bus.messages import ExecuteSkillFeedback, ExecuteSkillGoal, ExecuteSkillResult
from aeros.runtime.bus.port import ActionServer, GoalAtServer, GoalStatus
from aeros.runtime.canonical_json import canonical
from aeros.runtime.ports import Ended, Runtime, StepHandle, StepRequest, StepResult, StepStatus

EXECUTE_SKILL: Final = "/aeros/execute_skill"
EXECUTE: Final = (ExecuteSkillGoal, ExecuteSkillFeedback, ExecuteSkillResult)

Server = ActionServer[ExecuteSkillGoal, ExecuteSkillFeedback, ExecuteSkillResult]
Goal = GoalAtServer[ExecuteSkillGoal, ExecuteSkillFeedback, ExecuteSkillResult]

MOST: Final = 8
"""Goals at a time; each may have a process of its own.  Others wait, and the server refuses too many."""

_TURN: Final = 0.05  # plant seconds after which cancellations and new goals are looked at again
_LOOK_EVERY: Final = 0.05  # s, while there is no goal


class Stepping(Runtime, Protocol):
    """A runtime that can be looked at between whatever it does; `Executor` is one."""

    def turn(self, until: float) -> Ended | None:
        """Let one thing happen, or time go on until `until`, in plant seconds; a step that has ended."""

    def counts(self, step: StepHandle) -> DecisionCounts | None:
        """What was decided of a step so far; None once it has ended."""


def pursue(server: Server, runtime: Stepping, is_over: Callable[[], bool]) -> None:
    """Pursue the goals of `server` until `is_over`, then cancel what is left, and close it.

    A goal succeeds where its skill finishes, is canceled where that was asked for and done, and is aborted
    otherwise; `status` and `reason` of the result say how the step ended.  What `runtime` raises goes
    through, and aborts every goal.
    """
    pursuit = _Pursuit(runtime)
    try:
        while not is_over():
            if len(pursuit.goals) < MOST:
                goal = server.take(0.0 if pursuit.goals else _LOOK_EVERY)
                if goal is not None:
                    pursuit.begin(goal)
            pursuit.cancel_as_asked()
            pursuit.go_on()
        pursuit.cancel_all()
        while pursuit.goals:
            pursuit.go_on()
    finally:
        server.close()


class _MalformedError(Exception):
    """The inputs of a goal are none; the message says why."""


@dataclass
class _Pursued:
    """A goal whose step is under way, and what was told of it."""

    goal: Goal
    told: DecisionCounts = field(default_factory=DecisionCounts)


class _Pursuit:
    """The goals under way, by their steps."""

    def __init__(self, runtime: Stepping) -> None:
        self.goals: dict[StepHandle, _Pursued] = {}
        self._runtime = runtime

    def begin(self, goal: Goal) -> None:
        """Start its step, or say why there is none."""
        asked = goal.goal
        try:
            inputs = _inputs_of(asked.inputs)
        except _MalformedError as wrong:
            refusal = {"module": asked.module, "skill": asked.skill, "reason": str(wrong)}
            self._runtime.note("goal-refused", refusal)
            _end(goal, StepResult(StepStatus.REFUSED, str(wrong)))
            return
        started = self._runtime.start(StepRequest(asked.module, asked.skill, inputs))
        if isinstance(started, StepResult):
            _end(goal, started)
        else:
            self.goals[started] = _Pursued(goal)

    def cancel_as_asked(self) -> None:
        """Cancel what whoever wants it does not want any more."""
        for step, pursued in self.goals.items():
            if pursued.goal.status is GoalStatus.CANCELING:
                self._runtime.cancel(step, "whoever had asked for it cancels it")

    def cancel_all(self) -> None:
        """Cancel whatever is under way."""
        for step in self.goals:
            self._runtime.cancel(step, "whoever pursues it ends")

    def go_on(self) -> None:
        """Let steps go on for a turn; tell how they go, and the result of one that has ended."""
        if not self.goals:
            return
        ended = self._runtime.turn(self._runtime.now() + _TURN)
        if ended is not None:
            _end(self.goals.pop(ended.step).goal, ended.result)
        for step, pursued in self.goals.items():
            counts = self._runtime.counts(step)
            if counts is not None and counts != pursued.told:
                pursued.told = counts
                pursued.goal.tell(ExecuteSkillFeedback(counts.allowed, counts.attenuated, counts.denied))


def _end(goal: Goal, result: StepResult) -> None:
    status = GoalStatus.ABORTED
    if result.status is StepStatus.FINISHED:
        status = GoalStatus.SUCCEEDED
    elif result.status is StepStatus.CANCELLED and goal.status is GoalStatus.CANCELING:
        status = GoalStatus.CANCELED
    counts = (result.allowed, result.attenuated, result.denied)
    outputs = canonical(dict(result.outputs)).decode()
    goal.end(status, ExecuteSkillResult(result.status.value, result.reason, outputs, *counts))


def _inputs_of(text: str) -> dict[str, Any]:
    """A JSON object, no name of it twice; of which types its values have to be, the skill declares."""
    try:
        inputs = json.loads(text, object_pairs_hook=_unique, parse_constant=_no_number)
    except RecursionError:
        raise _MalformedError("the inputs are nested too deeply") from None
    except ValueError as wrong:
        raise _MalformedError(f"the inputs are not JSON: {wrong}") from None
    if type(inputs) is not dict:
        raise _MalformedError("the inputs are not a JSON object")
    return inputs


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        raise _MalformedError("an input is given twice")
    return found


def _no_number(text: str) -> None:
    raise _MalformedError(f"`{text}` is no number of JSON")
