"""Goals of `/aeros/pursue`: the agent pursues one instruction after the other."""

from __future__ import annotations

from collections.abc import Callable
from math import inf
from typing import Final

from aeros.agent.agent import Agent
from aeros.agent.errors import AgentError
from aeros.agent.execution.journal import AgentEvent
from aeros.agent.execution.report import RunReport
from aeros.agent.instructions.meaning import Understanding
from aeros.agent.instructions.refusals import InstructionError
from aeros.runtime.bus.messages import PursueFeedback, PursueGoal, PursueResult
from aeros.runtime.bus.port import ActionServer, GoalStatus, ServerGoal
from aeros.runtime.canonical_json import to_canonical_json
from aeros.runtime.ports import Runtime

PURSUE: Final = "/aeros/pursue"
PURSUIT: Final = (PursueGoal, PursueFeedback, PursueResult)

InstructionServer = ActionServer[PursueGoal, PursueFeedback, PursueResult]
InstructionGoal = ServerGoal[PursueGoal, PursueFeedback, PursueResult]


class InstructionGoals:
    """Server of instructions; used by the thread that runs the robot.

    Args:
        server: Server of `/aeros/pursue`.
        understand: Returns the meaning of an instruction that this robot can pursue.
    """

    def __init__(self, server: InstructionServer, understand: Callable[[str], Understanding]) -> None:
        self._server = server
        self._understand = understand
        self._goal: InstructionGoal | None = None

    def on_event(self, event: AgentEvent) -> None:
        """Send an event of the agent as feedback to the client of the goal.

        Args:
            event: The event.
        """
        if self._goal is not None:
            self._goal.send_feedback(PursueFeedback(event.kind, event.text))

    def take_turn(self, agent: Agent, runtime: Runtime, timeout: float) -> None:
        """Accept a goal, if there is one, and pursue it to its end.

        Args:
            agent: The agent.
            runtime: Keeps the record of who asked.
            timeout: s of real time to wait for a goal.
        """
        goal = self._server.next_goal(timeout)
        if goal is None:
            return
        asked = goal.goal
        clients = [one._asdict() for one in goal.requesters]
        runtime.note("goal-requested", {"instruction": asked.instruction, "clients": clients})
        try:
            timeout_s = _timeout_of(asked)
            meaning = self._understand(asked.instruction)
        except InstructionError as error:
            runtime.note("goal-rejected", {"instruction": asked.instruction, "reason": error.reason})
            goal.set_result(GoalStatus.ABORTED, PursueResult(reason=error.reason))
            return
        self._goal = goal
        agent.is_cancelled = lambda: goal.status is GoalStatus.CANCELING
        try:
            report = agent.run(meaning, timeout_s)
        except AgentError as error:
            goal.set_result(GoalStatus.ABORTED, PursueResult(reason=str(error)))
        else:
            goal.set_result(_status_of(report, goal), _result_of(report))
        finally:
            self._goal, agent.is_cancelled = None, None

    def close(self) -> None:
        """Accept no more goals, and abort those that wait."""
        self._server.close()


def _timeout_of(asked: PursueGoal) -> float | None:
    """Return the time limit of a goal, s on the plant's clock; None for no limit.

    Raises:
        InstructionError: it is negative or not finite, which nobody means.
    """
    if not 0.0 <= asked.timeout < inf:
        raise InstructionError(f"`timeout` is {asked.timeout:g} s; give 0 for no limit, or a time above 0")
    return asked.timeout or None


def _status_of(report: RunReport, goal: InstructionGoal) -> GoalStatus:
    if not report.has_failed:
        return GoalStatus.SUCCEEDED
    return GoalStatus.CANCELED if goal.status is GoalStatus.CANCELING else GoalStatus.ABORTED


def _result_of(report: RunReport) -> PursueResult:
    return PursueResult(
        report.reached,
        report.reason or "",
        to_canonical_json(dict(report.measured)).decode(),
        len(report.steps),
        report.allowed,
        report.attenuated,
        report.denied,
    )
