"""Transport of the MCP server over standard input and output, for one client that started the process."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from typing import Any, Final, Self

import anyio
import anyio.to_thread
from mcp.server.lowlevel import Server
from mcp.server.stdio import stdio_server

_POLL_INTERVAL_S: Final = 0.1  # s
_MAX_LINE_BYTES: Final = 1_000_000  # bytes


def serve_stdio(server: Server[Any], is_over: Callable[[], bool], warn: Callable[[str], None]) -> None:
    """Serve one client until it disconnects or `is_over` returns true.

    Args:
        server: Answers the client.
        is_over: Polled every 0.1 s.
        warn: Gets a sentence about input that is no message.
    """

    async def watch(scope: anyio.CancelScope) -> None:
        while not is_over():
            await anyio.sleep(_POLL_INTERVAL_S)
        scope.cancel()

    async def answer() -> None:
        lines: Any = _StdinLines(warn)
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

    def __init__(self, warn: Callable[[str], None]) -> None:
        self._warn = warn
        self._has_warned = False
        self._file = os.dup(0)
        with open(os.devnull, "rb") as nothing:
            os.dup2(nothing.fileno(), 0)
        self._rest = b""

    def __aiter__(self) -> Self:
        return self

    async def __anext__(self) -> str:
        while b"\n" not in self._rest:
            if len(self._rest) > _MAX_LINE_BYTES:
                # A hostile client; where the next message starts is unknown.
                self._warn(f"the client sent a line of more than {_MAX_LINE_BYTES} bytes; the session ends")
                raise StopAsyncIteration
            await anyio.wait_readable(self._file)
            read = os.read(self._file, 65_536)
            if not read:
                raise StopAsyncIteration
            self._rest += read
        line, _, self._rest = self._rest.partition(b"\n")
        # The SDK drops such a line without a word.
        if not self._has_warned and not line.lstrip().startswith(b"{"):
            self._has_warned = True
            self._warn("a line of the input is no message of the protocol; such lines get no answer")
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
