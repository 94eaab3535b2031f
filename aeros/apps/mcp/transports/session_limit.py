"""Limit of the sessions of older clients: a new one displaces the one that has been idle for longest.

Most clients go away without a word.  Their sessions would keep later clients out until they expire.
"""

from __future__ import annotations

from dataclasses import dataclass
from http import HTTPStatus
from typing import Final

from mcp_types.version import MODERN_PROTOCOL_VERSIONS

from aeros.apps.mcp.transports.request_limit import Application, Message, Receive, Send

MAX_SESSIONS: Final = 16

_SESSION: Final = b"mcp-session-id"
_VERSION: Final = b"mcp-protocol-version"
_MODERN: Final = frozenset(one.encode() for one in MODERN_PROTOCOL_VERSIONS)


@dataclass(slots=True)
class _Session:
    """Session of a client; `requests` counts those that are being answered, an open stream among them."""

    requests: int = 0


class SessionLimit:
    """ASGI application that ends an idle session where a new one would be one too many.

    Args:
        app: Application behind it, which has the sessions and refuses one too many itself.
    """

    def __init__(self, app: Application) -> None:
        self._app = app
        self._sessions: dict[bytes, _Session] = {}
        """By id; the one that was used last is the last one."""

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """Implement ASGI: pass a request on, after room is made for its session.

        Args:
            scope: The request's headers and address.
            receive: Receives its messages.
            send: Sends those of the response.
        """
        headers = {} if scope["type"] != "http" else dict(scope["headers"])
        name = headers.get(_SESSION)
        method = scope.get("method")
        if method == "POST" and name is None and headers.get(_VERSION) not in _MODERN:
            await self._make_room(scope)
        has_ended = False

        async def answer(message: Message) -> None:
            nonlocal has_ended
            if message["type"] == "http.response.start":
                status = message["status"]
                has_ended = status == HTTPStatus.NOT_FOUND or (method == "DELETE" and status < 400)
                made = dict(message.get("headers", ())).get(_SESSION)
                if made is not None and status < 400 and not has_ended:
                    self._sessions.setdefault(made, _Session())
            await send(message)

        session = None if name is None else self._sessions.pop(name, None)
        if name is None or session is None:
            await self._app(scope, receive, answer)
            return
        self._sessions[name] = session
        session.requests += 1
        try:
            await self._app(scope, receive, answer)
        finally:
            session.requests -= 1
            if has_ended:  # else the application behind still has it
                self._sessions.pop(name, None)

    async def _make_room(self, scope: Message) -> None:
        while len(self._sessions) >= MAX_SESSIONS:
            idle = next((name for name, one in self._sessions.items() if not one.requests), None)
            if idle is None:
                return
            del self._sessions[idle]
            await self._end(idle, scope)

    async def _end(self, name: bytes, scope: Message) -> None:
        """End a session as its client would, by a request of the protocol."""
        kept = [(key, value) for key, value in scope["headers"] if key in (b"host", b"authorization")]
        request = {**scope, "method": "DELETE", "headers": [*kept, (_SESSION, name)]}

        async def receive() -> Message:
            return {"type": "http.request", "body": b"", "more_body": False}

        async def drop(_: Message) -> None:
            pass

        await self._app(request, receive, drop)
