"""Transport of the MCP server over streamable HTTP, for clients on this host.

Each request must name this server in `Host`, come from no foreign web page (`Origin`), and present the token,
in that order.  So a web page that rebinds its name to this host is refused before its token is looked at.
"""

from __future__ import annotations

import hmac
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Final

import anyio
import uvicorn
from mcp.server.lowlevel import Server
from mcp.server.transport_security import TransportSecuritySettings

from aeros.apps.http_hosts import allowed_hosts
from aeros.apps.mcp.server import DISCONNECT_KEY
from aeros.apps.mcp.transports.http_address import HTTP_PATH
from aeros.apps.mcp.transports.http_connection import BoundedConnection
from aeros.apps.mcp.transports.request_limit import (
    MAX_BODY_BYTES,
    Application,
    Message,
    Receive,
    RequestLimit,
    Send,
    refuse,
)
from aeros.apps.mcp.transports.session_limit import MAX_SESSIONS, SessionLimit

UNATTENDED_LIMIT_S: Final = 10.0
"""Real time for which a plan goes on while no client waits for it (s)."""

_POLL_INTERVAL_S: Final = 0.1  # s
_MAX_BACKLOG: Final = 128
_SESSION_IDLE_S: Final = 600.0
_GRACE_S: Final = 0.5
"""Real time for calls to end by themselves once the server is over; streams of a client never do."""


def serve_http(
    server: Server[Any],
    listener: socket.socket,
    token: str,
    on_poll: Callable[[], None],
    is_over: Callable[[], bool],
) -> None:
    """Serve clients until `is_over` returns true.

    Args:
        server: Answers the clients.
        listener: Listening socket; it is closed at the end.
        token: Token that each request has to present.
        on_poll: Called every 0.1 s.
        is_over: Polled every 0.1 s.
    """
    hosts = allowed_hosts(*listener.getsockname()[:2])
    origins = [f"http://{one}" for one in hosts]
    app: Any = server.streamable_http_app(
        streamable_http_path=HTTP_PATH,
        host=listener.getsockname()[0],
        max_request_body_size=MAX_BODY_BYTES,
        max_sessions=MAX_SESSIONS,
        session_idle_timeout=_SESSION_IDLE_S,
        transport_security=TransportSecuritySettings(allowed_hosts=hosts, allowed_origins=origins),
    )
    guard = RequestGuard(RequestLimit(SessionLimit(app)), hosts, origins, token)
    configuration = uvicorn.Config(
        guard,
        http=BoundedConnection,
        log_level="error",
        access_log=False,
        lifespan="on",
        ws="none",
        server_header=False,
        backlog=_MAX_BACKLOG,
        timeout_graceful_shutdown=2,
    )
    http = _HttpServer(configuration)

    async def watch() -> None:
        while not is_over():
            on_poll()
            await anyio.sleep(_POLL_INTERVAL_S)
        http.should_exit = True
        await anyio.sleep(_GRACE_S)
        guard.end_requests()

    async def answer() -> None:
        async with anyio.create_task_group() as group:
            group.start_soon(watch)
            await http.serve(sockets=[listener])
            group.cancel_scope.cancel()

    anyio.run(answer)


class _HttpServer(uvicorn.Server):
    """Server that leaves signals to the process."""

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        yield


class RequestGuard:
    """ASGI application that passes on requests with the right `Host`, `Origin` and token, and no others.

    It also puts an event into the scope of each request, under `DISCONNECT_KEY`, that is set when the
    connection breaks before the response is complete.

    Args:
        app: Application behind it.
        hosts: Values of `Host` that are allowed.
        origins: Values of `Origin` that are allowed; a request without one is, too.
        token: Token that each request has to present.
    """

    def __init__(self, app: Application, hosts: list[str], origins: list[str], token: str) -> None:
        self._app = app
        self._hosts = frozenset(one.encode() for one in hosts)
        self._origins = frozenset(one.encode() for one in origins)
        self._token = token.encode()
        self._open: set[anyio.CancelScope] = set()

    def end_requests(self) -> None:
        """End all requests that are under way, each with a complete response."""
        for one in list(self._open):
            one.cancel()

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """Implement ASGI: answer a request with a refusal, or pass it on.

        Args:
            scope: The request's headers and address.
            receive: Receives its messages.
            send: Sends those of the response.
        """
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        refusal = self._refusal(scope)
        if refusal is not None:
            await refuse(receive, send, *refusal)
            return
        scope[DISCONNECT_KEY] = disconnected = threading.Event()
        has_started = is_complete = False

        async def listen() -> Message:
            message = await receive()
            if message["type"] == "http.disconnect" and not is_complete:
                disconnected.set()
            return message

        async def answer(message: Message) -> None:
            nonlocal has_started, is_complete
            has_started = True
            is_complete |= message["type"] == "http.response.body" and not message.get("more_body", False)
            await send(message)

        with anyio.CancelScope() as until_end:
            self._open.add(until_end)
            try:
                await self._app(scope, listen, answer)
            finally:
                self._open.discard(until_end)
        if until_end.cancelled_caught and not is_complete:
            if has_started:
                await send({"type": "http.response.body"})
            else:
                await refuse(None, send, 503, "the server has ended")

    def _refusal(self, scope: Message) -> tuple[int, str] | None:
        """Return status and text of the refusal of a request; None if it is passed on."""
        given = _headers(scope)
        if scope["type"] != "http":
            return 400, "HTTP requests only"
        if given.get(b"host", []) == [] or not set(given[b"host"]) <= self._hosts:
            return 421, "this server has another Host"
        if not set(given.get(b"origin", [])) <= self._origins:
            return 403, "web pages of other origins may not connect"
        presented = given.get(b"authorization", [])
        scheme, _, token = presented[0].partition(b" ") if len(presented) == 1 else (b"", b"", b"")
        if scheme.lower() != b"bearer" or not hmac.compare_digest(token.strip(), self._token):
            return 401, "present the server's token: Authorization: Bearer TOKEN"
        return None


def _headers(scope: Message) -> dict[bytes, list[bytes]]:
    found: dict[bytes, list[bytes]] = {}
    for name, value in scope["headers"]:
        found.setdefault(name.lower(), []).append(value)
    return found
