"""Connections of the HTTP server, so limited that they keep no later client out.

Anyone who reaches the port can open connections, without a token.  So a connection must bring each request
soon, and a new connection displaces an old one when there are too many.
"""

from __future__ import annotations

import asyncio
from typing import Final

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

MAX_CONNECTIONS: Final = 256
REQUEST_LIMIT_S: Final = 10.0
"""Real time from the start of a connection, or its last response, to the end of the next request (s)."""

_REQUEST_MISSING: Final = (h11.IDLE, h11.SEND_BODY)


class BoundedConnection(H11Protocol):
    """Connection that is closed if it brings no complete request in time.

    Each new one beyond `MAX_CONNECTIONS` closes the oldest that waits for a request.  If all have brought
    theirs, it closes the oldest of them: a newcomer may want to stop the robot.
    """

    _deadline: asyncio.TimerHandle | None = None
    _opened_at = 0.0
    _is_aborted = False

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Implement `asyncio.Protocol`: start the time limit, and make room.

        Args:
            transport: Sends and receives the bytes.
        """
        super().connection_made(transport)
        self._opened_at = self.loop.time()
        self._restart_deadline()
        others = [one for one in self.connections if isinstance(one, BoundedConnection)]
        others = [one for one in others if one is not self and not one._is_aborted]
        if len(others) >= MAX_CONNECTIONS:
            min(others, key=lambda one: (one.has_request, one._opened_at)).abort()

    def connection_lost(self, exc: Exception | None) -> None:
        """Implement `asyncio.Protocol`.

        Args:
            exc: Why the connection broke; None if it was closed.
        """
        if self._deadline is not None:
            self._deadline.cancel()
        super().connection_lost(exc)

    def on_response_complete(self) -> None:
        """Wait for the next request."""
        super().on_response_complete()
        self._restart_deadline()

    @property
    def has_request(self) -> bool:
        """True from the end of a request to the end of its response."""
        return self.conn.their_state not in _REQUEST_MISSING

    def abort(self) -> None:
        """Close the connection without sending what is left."""
        self._is_aborted = True
        self.transport.abort()

    def _restart_deadline(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
        self._deadline = self.loop.call_later(REQUEST_LIMIT_S, self._abort_if_late)

    def _abort_if_late(self) -> None:
        if not self.has_request:
            self.abort()
