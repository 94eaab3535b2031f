"""Tools of MCP clients that hold the robot, and the one that asks the operator to let it go on."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Final

from aeros.apps.mcp.approvals import Approval, Approvals
from aeros.apps.mcp.client_notes import ClientNotes
from aeros.apps.mcp.robot import McpRobotThread
from aeros.apps.mcp.tool_arguments import ToolCallError
from aeros.runtime.execution.governor import OperatorCommand
from aeros.runtime.registry.control_page import MotionTimeoutError

HOLD_WORDS: Final = {
    OperatorCommand.RUN: "running",
    OperatorCommand.PAUSE: "paused",
    OperatorCommand.STOP: "stopped",
}
"""Word for each command of the operator."""


class HoldTools:
    """The tools `pause`, `stop` and `resume`.

    Args:
        robot: Thread of the robot.
        approvals: Requests to the operator.
        discard_plans: Discards all accepted plans and their requests.
        notes: Writes notes to the audit log.
        ask: Requests an operator command and returns when it is in effect.
        command: Returns the command in force.
    """

    def __init__(
        self,
        robot: McpRobotThread,
        approvals: Approvals,
        discard_plans: Callable[[], None],
        notes: ClientNotes,
        ask: Callable[[OperatorCommand], None],
        command: Callable[[], OperatorCommand],
    ) -> None:
        self._robot = robot
        self._approvals = approvals
        self._discard_plans = discard_plans
        self._notes = notes
        self._ask = ask
        self._command = command
        self._request: str | None = None
        self._lock = threading.Lock()

    def pause(self, client: str) -> dict[str, Any]:
        """Pause, unless the robot is paused or stopped already.

        Args:
            client: The client's name, as it gives it.

        Returns:
            The result of the tool.

        Raises:
            MotionTimeoutError: A motion has not ended in time; the robot is paused nevertheless.
        """
        with self._noted("mcp-paused", client):
            if self._command() is OperatorCommand.RUN:
                self._ask(OperatorCommand.PAUSE)
        return {"status": HOLD_WORDS[self._command()]}

    def stop(self, client: str) -> dict[str, Any]:
        """Stop all motion and discard all plans.

        Args:
            client: The client's name, as it gives it.

        Returns:
            The result of the tool.

        Raises:
            MotionTimeoutError: A motion has not ended in time; the plans are void nevertheless.
        """
        with self._noted("mcp-stopped", client):
            try:
                self._ask(OperatorCommand.STOP)
            finally:
                self._discard_plans()
        return {"status": HOLD_WORDS[self._command()]}

    def resume(self, client: str) -> dict[str, Any]:
        """Resume with the operator's approval, or ask for it.

        Args:
            client: The client's name, as it gives it.

        Returns:
            The result of the tool.

        Raises:
            ToolCallError: The plan that was stopped has not ended yet.
        """
        if self._command() is OperatorCommand.RUN:
            return {"status": "the robot is neither paused nor stopped"}
        if self._robot.is_busy and self._command() is OperatorCommand.STOP:
            raise ToolCallError("the plan that was stopped has not ended yet")
        with self._lock:
            approval = self._approvals.consume(self._request)
            if approval is None:
                known = None if self._approvals.is_rejected(self._request) else self._request
                self._request = self._approvals.request({"what": "resume", "client": client}, known)
                return {"status": "waits for approval", "operator": f"aeros approve {self._request}"}
            self._request = None
        self._notes.write_always("mcp-resumed", {"client": client, "approved": approval_note(approval)})
        self._ask(OperatorCommand.RUN)
        return {"status": "resumed"}

    @contextmanager
    def _noted(self, event: str, client: str) -> Iterator[None]:
        """Write a note of the block, also if a motion outlasts it."""
        try:
            yield
        except MotionTimeoutError:
            self._notes.write_always(event, {"client": client, "still_moving": True})
            raise
        self._notes.write_always(event, {"client": client})


def approval_note(approval: Approval) -> dict[str, Any]:
    """Return an approval as audit notes hold it.

    Args:
        approval: The approval.

    Returns:
        JSON values.
    """
    return {"by": approval.approved_by, "at": approval.approved_at, "verified": approval.is_verified}
