"""An MCP server over HTTP in this process, and clients of it that write their requests themselves."""

from __future__ import annotations

import http.client
import json
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager
from typing import Any

from aeros.apps.mcp.transports.http_address import open_listener, parse_address, server_url
from tests.unit.apps.mcp.cells import LAID_OUT, PREPARE, Cell

TOKEN = "a" * 40
LIMIT_S = 1.0


@contextmanager
def served(one: Cell) -> Iterator[int]:
    """A server of this cell's tools in a thread of its own; its port."""
    from aeros.apps.mcp.resources import Resources
    from aeros.apps.mcp.server import build_server
    from aeros.apps.mcp.transports import http_server

    listener = open_listener(parse_address("0"))
    port: int = listener.getsockname()[1]
    assert server_url(listener) == f"http://127.0.0.1:{port}/mcp"
    is_over = threading.Event()
    server = build_server(one.tools, Resources(one.tools, one.folder / "audit.jsonl"))
    thread = threading.Thread(
        target=http_server.serve_http,
        args=(server, listener, TOKEN, lambda: one.tools.cancel_unattended(LIMIT_S), is_over.is_set),
    )
    thread.start()
    try:
        yield port
    finally:
        is_over.set()
        thread.join(20)
        assert not thread.is_alive()


class HttpClient:
    """A client that writes its requests itself, of the protocol's version without sessions."""

    def __init__(self, port: int, **headers: str) -> None:
        self.port = port
        self.headers = {
            "Authorization": f"Bearer {TOKEN}",
            "Content-Type": "application/json",
            "Accept": "application/json, text/event-stream",
            "MCP-Protocol-Version": "2026-07-28",
            **headers,
        }

    def request(self, method: str, params: dict[str, Any]) -> http.client.HTTPConnection:
        meta = {
            "io.modelcontextprotocol/protocolVersion": "2026-07-28",
            "io.modelcontextprotocol/clientInfo": {"name": "by hand", "version": "1"},
            "io.modelcontextprotocol/clientCapabilities": {},
        }
        body = {"jsonrpc": "2.0", "id": 1, "method": method, "params": {**params, "_meta": meta}}
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=30)
        named = {"Mcp-Method": method, **({"Mcp-Name": params["name"]} if "name" in params else {})}
        connection.request("POST", "/mcp", json.dumps(body), {**self.headers, **named})
        return connection

    def answer(self, method: str, params: dict[str, Any]) -> tuple[int, Any]:
        with closing(self.request(method, params)) as connection:
            response = connection.getresponse()
            text = response.read().decode()
        if response.headers["Content-Type"] == "text/event-stream":
            text = text.rpartition("data: ")[2]
        return response.status, json.loads(text) if text.startswith("{") else text

    def call(self, tool: str, **arguments: Any) -> Any:
        status, found = self.answer("tools/call", {"name": tool, "arguments": arguments})
        assert status == 200, found
        result = found["result"]
        return result["content"][0]["text"] if result.get("isError") else result["structuredContent"]

    def watch(self, plan: str) -> http.client.HTTPConnection:
        """A connection whose answer comes when the plan has ended."""
        return self.request("tools/call", {"name": "execute_plan", "arguments": {"plan": plan, "wait": 60}})

    def proposed(self) -> str:
        plan: str = self.call("propose_plan", steps=PREPARE, goal=LAID_OUT)["plan"]
        return plan
