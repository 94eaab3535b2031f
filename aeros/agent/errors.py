"""What the agent refuses, with the reason in words."""

from __future__ import annotations

from aeros.spec.diagnostics.errors import UserError


class AgentError(UserError):
    """The agent does not start or does not take the task; `reason` says why, for people."""

    def __init__(self, reason: str) -> None:
        super().__init__(())
        self.reason = reason

    def __str__(self) -> str:
        return self.reason
