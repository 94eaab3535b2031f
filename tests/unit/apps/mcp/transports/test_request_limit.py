"""Requests beyond the limit are refused, unless they pause, stop or cancel."""

from __future__ import annotations

import json
import time
from contextlib import ExitStack, closing
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.execution.governor import OperatorCommand
from tests.unit.apps.mcp.cells import FREE, cell, dumplings
from tests.unit.apps.mcp.http_clients import HttpClient, served

pytestmark = pytest.mark.skipif(find_spec("mcp") is None, reason="the extra `mcp` is not installed")


def call(name: Any) -> bytes:
    return json.dumps({"jsonrpc": "2.0", "id": 1, "method": "tools/call", "params": {"name": name}}).encode()


BODIES = {
    "a stop": (call("stop"), True),
    "a pause": (call("pause"), True),
    "the cancellation of a call": (b'{"method": "notifications/cancelled"}', True),
    "a resume": (call("resume"), False),
    "a name that is a list": (call(["stop"]), False),
    "parameters that are a list": (b'{"method": "tools/call", "params": ["stop"]}', False),
    "a prompt named stop": (call("stop").replace(b"tools/call", b"prompts/get"), False),
    "a list": (b"[1]", False),
    "no JSON": (b"stop", False),
    "no text": (b"\xff\xfe\xfd", False),
    "deep nesting": (b"[" * 60_000, False),
    "a stop in too many bytes": (call("stop") + b" " * 70_000, False),
}


@pytest.mark.parametrize("name", BODIES)
def test_beyond_the_limit_only_what_holds_the_robot_is_passed_on(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    import anyio

    from aeros.apps.mcp.transports import request_limit

    body, is_passed = BODIES[name]
    monkeypatch.setattr(request_limit, "MAX_REQUESTS", 0)
    chunks = [body[at : at + 1000] for at in range(0, len(body), 1000)]
    received: list[bytes] = []
    sent: list[Any] = []

    async def receive() -> Any:
        return {"type": "http.request", "body": chunks.pop(0), "more_body": len(chunks) > 0}

    async def send(message: Any) -> None:
        sent.append(message)

    async def application(_scope: Any, receive: Any, _send: Any) -> None:
        received.append((await receive())["body"])

    limited = request_limit.RequestLimit(application)
    anyio.run(limited, {"type": "http"}, receive, send)
    assert received == ([body] if is_passed else [])
    assert [one["status"] for one in sent if "status" in one] == ([] if is_passed else [503])
    assert chunks == []


def test_a_stop_goes_through_while_all_requests_are_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from aeros.apps.mcp.transports import request_limit

    monkeypatch.setattr(request_limit, "MAX_REQUESTS", 3)
    with cell(dumplings(), tmp_path, FREE) as one, served(one) as port, ExitStack() as stack:
        client = HttpClient(port)
        plan = client.proposed()
        one.operator.at_first["decision"] = lambda: one.operator.ask(OperatorCommand.PAUSE)
        watching = [stack.enter_context(closing(client.watch(plan))) for _ in range(3)]
        state = {"name": "state", "arguments": {}}
        latest = time.monotonic() + 10
        while client.answer("tools/call", state) != (503, {"error": "too many requests (3)"}):
            assert time.monotonic() < latest
        assert client.call("stop") == {"status": "stopped"}
        for connection in watching:
            assert "stopped by the operator" in connection.getresponse().read().decode()
        assert client.answer("tools/call", state)[0] == 200
