"""Errors that the agent raises for its user, with the reason in words."""

from __future__ import annotations

from aeros.spec.diagnostics.errors import UserError


class AgentError(UserError):
    """An agent that does not start or does not accept a task; `reason` says why, for people."""

    def __init__(self, reason: str) -> None:
        super().__init__(())
        self.text = self.reason = reason
        self.args = (reason,)
