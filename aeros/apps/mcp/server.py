"""MCP server on standard input and output.  Sole importer of the MCP SDK."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from typing import Any, Final, Self

import anyio
import anyio.to_thread
import mcp_types as types
from mcp.server.context import ServerRequestContext
from mcp.server.lowlevel import Server
from mcp.server.stdio import stdio_server

import aeros
from aeros.apps.mcp.tool_arguments import SCHEMAS, ToolCallError, tool_schema
from aeros.apps.mcp.tools import DESCRIPTIONS, Tools
from aeros.apps.report_page.run_data import shortened

_POLL_INTERVAL_S: Final = 0.1  # s
_MAX_LINE_BYTES: Final = 1_000_000  # bytes
_HOLD_TOOLS = frozenset(("pause", "stop"))
_READ_ONLY_TOOLS = frozenset(("list_skills", "state", "propose_plan"))


def serve(tools: Tools, is_over: Callable[[], bool]) -> None:
    """Serve one client until it disconnects or `is_over` returns true.

    Args:
        tools: The tools to serve.
        is_over: Polled every 0.1 s.
    """
    holding: anyio.CapacityLimiter | None = None

    async def list_tools(
        _: ServerRequestContext[Any, Any], __: types.PaginatedRequestParams | None
    ) -> types.ListToolsResult:
        return types.ListToolsResult(tools=[_tool_description(name) for name in SCHEMAS])

    async def call_tool(
        context: ServerRequestContext[Any, Any], params: types.CallToolRequestParams
    ) -> types.CallToolResult:
        client = _client_name(context)

        def call() -> types.CallToolResult:
            try:
                found = tools.call(params.name, params.arguments or {}, client)
            except ToolCallError as refusal:
                content = types.TextContent(type="text", text=shortened(str(refusal), 4000))
                return types.CallToolResult(content=[content], is_error=True)
            text = types.TextContent(type="text", text=json.dumps(found, default=str))
            return types.CallToolResult(content=[text], structured_content=found)

        # Pause and stop have their own limiter, so that they never wait behind other calls.
        limiter = holding if params.name in _HOLD_TOOLS else None
        return await anyio.to_thread.run_sync(call, abandon_on_cancel=True, limiter=limiter)

    server: Server[Any] = Server(
        "aeros", version=aeros.__version__, on_list_tools=list_tools, on_call_tool=call_tool
    )

    async def watch(scope: anyio.CancelScope) -> None:
        while not is_over():
            await anyio.sleep(_POLL_INTERVAL_S)
        scope.cancel()

    async def answer() -> None:
        nonlocal holding
        holding = anyio.CapacityLimiter(4)
        lines: Any = _StdinLines()
        answers: Any = _StdoutLines()
        # Cancelling the scope ends the reader; otherwise only the client can end it.
        async with anyio.create_task_group() as group:
            group.start_soon(watch, group.cancel_scope)
            async with stdio_server(stdin=lines, stdout=answers) as (reading, writing):
                await server.run(reading, writing, server.create_initialization_options())
            group.cancel_scope.cancel()

    anyio.run(answer)


class _StdinLines:
    """Lines of standard input, which is empty for all other readers from now on.

    The SDK's own reader waits in a thread that cannot be ended, so the process would not end either; and it
    accepts lines of any length.
    """

    def __init__(self) -> None:
        self._file = os.dup(0)
        with open(os.devnull, "rb") as nothing:
            os.dup2(nothing.fileno(), 0)
        self._rest = b""

    def __aiter__(self) -> Self:
        return self

    async def __anext__(self) -> str:
        while b"\n" not in self._rest:
            if len(self._rest) > _MAX_LINE_BYTES:
                raise StopAsyncIteration  # a hostile client; where the next message starts is unknown
            await anyio.wait_readable(self._file)
            read = os.read(self._file, 65_536)
            if not read:
                raise StopAsyncIteration
            self._rest += read
        line, _, self._rest = self._rest.partition(b"\n")
        return line.decode("utf-8", "replace")


class _StdoutLines:
    """Lines of standard output; whatever else is written there goes to standard error from now on.

    The SDK writes text of clients and skills as it is. Here each message is JSON in ASCII, so that no
    character of it acts on a terminal.
    """

    def __init__(self) -> None:
        self._file = os.dup(1)
        os.dup2(2, 1)

    async def write(self, text: str) -> None:
        await anyio.to_thread.run_sync(self._write, ascii_message(text).encode() + b"\n")

    async def flush(self) -> None:
        pass

    def _write(self, line: bytes) -> None:
        while line:
            line = line[os.write(self._file, line) :]


def ascii_message(text: str) -> str:
    """Write a message of the protocol without a character that a reader cannot see.

    Args:
        text: JSON.

    Returns:
        The same JSON on one line of printable ASCII characters.
    """
    return json.dumps(json.loads(text), separators=(",", ":")).replace("\x7f", "\\u007f")


def _tool_description(name: str) -> types.Tool:
    return types.Tool(
        name=name,
        description=DESCRIPTIONS[name],
        input_schema=tool_schema(name),
        annotations=types.ToolAnnotations(read_only_hint=name in _READ_ONLY_TOOLS, open_world_hint=False),
    )


def _client_name(context: ServerRequestContext[Any, Any]) -> str:
    """Return the name that the client gives itself."""
    parameters = context.session.client_params
    if parameters is None:
        return "an unnamed client"
    return shortened(f"{parameters.client_info.name} {parameters.client_info.version}", 120)
