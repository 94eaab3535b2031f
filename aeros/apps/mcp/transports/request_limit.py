"""Limit of the requests that the HTTP server answers at once; those that hold the robot are exempt."""

from __future__ import annotations

import json
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any, Final

from aeros.apps.mcp.server import HOLD_TOOLS

MAX_REQUESTS: Final = 64
MAX_BODY_BYTES: Final = 1_000_000

_MAX_HOLD_BYTES: Final = 65_536

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
Application = Callable[[Message, Receive, Send], Awaitable[None]]


class RequestLimit:
    """ASGI application that refuses requests while `MAX_REQUESTS` others are answered.

    It passes on all the same a call of `pause` or `stop`, and the cancellation of a call, which brakes too.

    Args:
        app: Application behind it.
    """

    def __init__(self, app: Application) -> None:
        self._app = app
        self._running = 0

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """Implement ASGI: answer a request with a refusal, or pass it on.

        Args:
            scope: The request's headers and address.
            receive: Receives its messages.
            send: Sends those of the response.
        """
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        if self._running >= MAX_REQUESTS:
            await self._answer_excess(scope, receive, send)
            return
        self._running += 1
        try:
            await self._app(scope, receive, send)
        finally:
            self._running -= 1

    async def _answer_excess(self, scope: Message, receive: Receive, send: Send) -> None:
        body, is_complete = await _read_body(receive)
        if not (is_complete and holds_robot(body)):
            await refuse(None if is_complete else receive, send, 503, f"too many requests ({MAX_REQUESTS})")
            return
        unread: list[Message] = [{"type": "http.request", "body": body, "more_body": False}]

        async def again() -> Message:
            return unread.pop() if unread else await receive()

        await self._app(scope, again, send)


def holds_robot(body: bytes) -> bool:
    """Check if a request pauses or stops the robot, or cancels a call.

    Args:
        body: The request's body, any bytes.

    Returns:
        True if it does; its parameters may be wrong nevertheless.
    """
    try:
        call = json.loads(body)
    except (ValueError, RecursionError):
        return False
    if not isinstance(call, dict):
        return False
    if call.get("method") == "notifications/cancelled":
        return True
    params = call.get("params")
    name = params.get("name") if isinstance(params, dict) else None
    return call.get("method") == "tools/call" and isinstance(name, str) and name in HOLD_TOOLS


async def refuse(receive: Receive | None, send: Send, status: int, text: str) -> None:
    """Answer a request with an error, and close its connection.

    Args:
        receive: Receives what is left of the request; None if nothing is.
        send: Sends the messages of the response.
        status: HTTP status.
        text: Why the request is refused.
    """
    # If a connection is closed with bytes unread, its client may never see the response.
    size, is_open = 0, receive is not None
    while receive is not None and is_open and size <= MAX_BODY_BYTES:
        message = await receive()
        size += len(message.get("body", b""))
        is_open = message.get("more_body", False)
    body = json.dumps({"error": text}).encode()
    headers = [
        (b"content-type", b"application/json"),
        (b"content-length", str(len(body)).encode()),
        (b"connection", b"close"),
    ]
    if status == 401:
        headers.append((b"www-authenticate", b"Bearer"))
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})


async def _read_body(receive: Receive) -> tuple[bytes, bool]:
    """Return the body of a request, and whether it is complete; a longer one is only begun."""
    body, is_open = b"", True
    while is_open and len(body) <= _MAX_HOLD_BYTES:
        message = await receive()
        body += message.get("body", b"")
        is_open = message.get("more_body", False)
    return body, not is_open
