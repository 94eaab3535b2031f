"""Services for tests: a server of HTTP, programs, and a server of the Model Context Protocol."""

from __future__ import annotations

import json
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

from aeros.spec.model.tools import Confinement

Answer = Callable[[dict[str, Any]], tuple[int, bytes]]


class _Handler(BaseHTTPRequestHandler):
    server: CookbookServer

    def do_POST(self) -> None:
        question = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        self.server.asked.append((self.path, question, self.headers.get("Authorization", "")))
        status, content = self.server.answer(question)
        self.send_response(status)
        if status == 302:
            self.send_header("Location", "/elsewhere")
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002 - the name of the base class
        pass


class CookbookServer(ThreadingHTTPServer):
    """Server that keeps what it was asked."""

    def __init__(self, answer: Answer) -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        self.answer = answer
        self.asked: list[tuple[str, dict[str, Any], str]] = []

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_address[1]}/time?unit=s"


@contextmanager
def cookbook(answer: Answer) -> Iterator[CookbookServer]:
    with CookbookServer(answer) as server:
        threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True).start()
        try:
            yield server
        finally:
            server.shutdown()


def ok(content: bytes) -> Answer:
    return lambda _: (200, content)


def slow(seconds: float) -> Answer:
    def answer(_: dict[str, Any]) -> tuple[int, bytes]:
        time.sleep(seconds)
        return 200, b"{}"

    return answer


PYTHON = Confinement(reads=tuple({sys.prefix, sys.base_prefix}))
"""Confinement of this interpreter, which may be in somebody's home."""


def python(body: str) -> tuple[str, ...]:
    """A program of this interpreter."""
    return (sys.executable, "-c", f"import json, sys, time, os\n{body}")


MCP_SERVER = """
import anyio
import mcp_types as types
from mcp.server.lowlevel import Server
from mcp.server.stdio import stdio_server


async def call_tool(context, params):
    if params.name == "fail":
        text = types.TextContent(type="text", text="no such book")
        return types.CallToolResult(content=[text], is_error=True)
    if params.name == "sleep":
        await anyio.sleep(60)
    text = types.TextContent(type="text", text='{"cooking_time": 7.5}')
    if params.name == "text":
        return types.CallToolResult(content=[text])
    return types.CallToolResult(
        content=[text], structured_content={"cooking_time": 60.0 * params.arguments["mass"]}
    )


async def list_tools(context, params):
    schema = {"type": "object"}
    names = ("ask", "text", "fail", "sleep")
    return types.ListToolsResult(tools=[types.Tool(name=name, input_schema=schema) for name in names])


async def main():
    server = Server("cookbook", on_list_tools=list_tools, on_call_tool=call_tool)
    async with stdio_server() as (read, write):
        await server.run(read, write, server.create_initialization_options())

anyio.run(main)
"""


def mcp_server(folder: Path) -> tuple[str, ...]:
    """Command of a server on standard input and output."""
    path = folder / "server.py"
    path.write_text(MCP_SERVER)
    return (sys.executable, str(path))
