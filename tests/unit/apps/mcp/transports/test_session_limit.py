"""Sessions of clients that went away without a word keep nobody out; those in use are not displaced."""

from __future__ import annotations

import http.client
import json
from contextlib import ExitStack, closing
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from tests.unit.apps.mcp.cells import FREE, cell, dumplings
from tests.unit.apps.mcp.http_clients import TOKEN, served

pytestmark = pytest.mark.skipif(find_spec("mcp") is None, reason="the extra `mcp` is not installed")

HELLO = {
    "jsonrpc": "2.0", "id": 1, "method": "initialize",
    "params": {
        "protocolVersion": "2025-11-25", "capabilities": {}, "clientInfo": {"name": "x", "version": "1"},
    },
}  # fmt: skip
PING = {"jsonrpc": "2.0", "id": 2, "method": "ping"}


def ask(port: int, method: str, body: Any = None, **headers: str) -> http.client.HTTPConnection:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
    accepted = "text/event-stream" if method == "GET" else "application/json, text/event-stream"
    sent = {"Authorization": f"Bearer {TOKEN}", "Content-Type": "application/json", "Accept": accepted}
    connection.request(method, "/mcp", None if body is None else json.dumps(body), {**sent, **headers})
    return connection


def status(port: int, method: str, body: Any = None, **headers: str) -> int:
    with closing(ask(port, method, body, **headers)) as connection:
        return connection.getresponse().status


def opened(port: int) -> str:
    """The id of a new session, whose client says no more; empty if it is refused."""
    with closing(ask(port, "POST", HELLO)) as connection:
        return connection.getresponse().headers["mcp-session-id"] or ""


def test_the_session_that_is_idle_for_longest_is_displaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in ("session_limit", "http_server"):
        monkeypatch.setattr(f"aeros.apps.mcp.transports.{module}.MAX_SESSIONS", 3)
    with cell(dumplings(), tmp_path, FREE) as one, served(one) as port, ExitStack() as streams:
        first, second, third = (opened(port) for _ in range(3))
        stream = streams.enter_context(closing(ask(port, "GET", **{"Mcp-Session-Id": first})))
        assert stream.getresponse().status == 200
        assert status(port, "POST", PING, **{"Mcp-Session-Id": second}) == 200
        fourth = opened(port)
        found = [status(port, "POST", PING, **{"Mcp-Session-Id": name}) for name in (second, third, fourth)]
        assert found == [200, 404, 200]
        assert status(port, "DELETE", **{"Mcp-Session-Id": second}) == 200
        fifth = opened(port)
        for name in (fourth, fifth):
            stream = streams.enter_context(closing(ask(port, "GET", **{"Mcp-Session-Id": name})))
            assert stream.getresponse().status == 200
        assert opened(port) == ""  # all three have a client that listens


def test_a_session_that_was_not_ended_is_displaced_like_any_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Forgotten here and kept by the application behind, it would keep every later client out."""
    for module in ("session_limit", "http_server"):
        monkeypatch.setattr(f"aeros.apps.mcp.transports.{module}.MAX_SESSIONS", 2)
    with cell(dumplings(), tmp_path, FREE) as one, served(one) as port:
        first, second = opened(port), opened(port)
        refused = status(port, "DELETE", **{"Mcp-Session-Id": first, "Mcp-Protocol-Version": "bogus"})
        assert refused >= 400
        assert all(status(port, method) >= 400 for method in ("GET", "DELETE"))  # they displace nobody
        found = [status(port, "POST", PING, **{"Mcp-Session-Id": name}) for name in (first, second)]
        assert found == [200, 200]
        assert status(port, "DELETE", **{"Mcp-Session-Id": first, "Mcp-Protocol-Version": "bogus"}) >= 400
        assert opened(port) != ""
        assert opened(port) != ""
