"""Calls of tools of MCP servers.  The runtime's sole importer of the SDK."""

from __future__ import annotations

import os
from collections.abc import AsyncIterator, Mapping, Sequence
from contextlib import asynccontextmanager
from typing import Any

import anyio
from mcp import ClientSession, StdioServerParameters
from mcp.client.stdio import stdio_client
from mcp.client.streamable_http import streamable_http_client
from mcp.shared._httpx_utils import create_mcp_http_client

from aeros.descriptions import describe_exception
from aeros.runtime.tools.confinement import confine
from aeros.runtime.tools.exchange import ToolError, bearer_header, late_reason, parse_answer
from aeros.spec.model.policy import IsolationPolicy
from aeros.spec.model.tools import McpService


def call_mcp(
    service: McpService, policy: IsolationPolicy, parameters: Mapping[str, Any], seconds: float
) -> Any:
    """Call a tool of an MCP server, in a session of its own; a server that is started is confined.

    Args:
        service: the server and its tool.
        policy: says which layers must confine a server that is started.
        parameters: parameters of the action, SI; the tool's arguments.
        seconds: time limit, s.

    Returns:
        The structured content of the result, or the parsed JSON of its text.

    Raises:
        ToolError: the server cannot be reached, takes too long, or reports an error.
    """
    if not service.command:
        return _run(service, (), parameters, seconds)
    with confine(service.command, service.confinement, policy, seconds) as confined:
        try:
            return _run(service, confined.arguments, parameters, seconds)
        except ToolError as failure:
            raise ToolError(confined.describe(str(failure))) from failure


def _run(service: McpService, command: Sequence[str], parameters: Mapping[str, Any], seconds: float) -> Any:
    try:
        return anyio.run(_call, service, command, dict(parameters), seconds)
    except ToolError:
        raise
    except BaseExceptionGroup as failures:
        own = failures.subgroup(ToolError)
        cause: BaseException = failures if own is None else own
        while isinstance(cause, BaseExceptionGroup):
            cause = cause.exceptions[0]
        if isinstance(cause, ToolError):
            raise cause from failures
        raise ToolError(f"it cannot be reached: {describe_exception(cause)}") from failures
    except Exception as failure:
        raise ToolError(f"it cannot be reached: {describe_exception(failure)}") from failure


async def _call(
    service: McpService, command: Sequence[str], arguments: dict[str, Any], seconds: float
) -> Any:
    with anyio.move_on_after(seconds):
        async with _session(service, command) as session:
            await session.initialize()
            result = await session.call_tool(service.tool, arguments)
            texts = [text for part in getattr(result, "content", ()) if (text := getattr(part, "text", None))]
            if getattr(result, "is_error", False):
                raise ToolError(f"it reported an error: {' '.join(texts)[:200]}")
            structured = getattr(result, "structured_content", None)
            if structured is not None:
                return structured
            return parse_answer("".join(texts).encode())
    raise ToolError(late_reason(seconds))


@asynccontextmanager
async def _session(service: McpService, command: Sequence[str]) -> AsyncIterator[ClientSession]:
    if command:
        program, *rest = command
        # What it prints on its standard error would reach the operator's terminal as it is.
        with open(os.devnull, "w", encoding="utf-8") as unread:
            async with (
                stdio_client(StdioServerParameters(command=program, args=rest), unread) as (read, write),
                ClientSession(read, write) as session,
            ):
                yield session
        return
    async with (
        create_mcp_http_client(headers=bearer_header(service.token)) as client,
        streamable_http_client(service.url, http_client=client) as streams,
        ClientSession(streams[0], streams[1]) as session,
    ):
        yield session
