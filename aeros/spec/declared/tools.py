"""Schema of tools: action kinds of a site that a service carries out, and not the robot."""

from __future__ import annotations

from dataclasses import dataclass, field

from aeros.spec.declared.field_types import Identifier
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.text.fields import TextField


@dataclass(frozen=True)
class McpServer:
    """A server of the Model Context Protocol, and one of its tools.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    tool: TextField = field(metadata={"doc": "the tool's name on the server, as in `tool: cooking_time`"})
    command: tuple[TextField, ...] = field(
        default=(), metadata={"doc": "the program that serves on its standard input and output"}
    )
    url: TextField | None = field(default=None, metadata={"doc": "the address of a running server"})


@dataclass(frozen=True)
class Tool:
    """A service that carries out an action: the runtime calls it with the parameters, and reads the answer.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    timeout: TextField = field(metadata={"doc": "the longest that a call may take, as in `timeout: 2 s`"})
    answers: tuple[Identifier, ...] = field(
        metadata={"doc": "the state variables that an answer may set; their `sensor` is the action's name"}
    )
    http: TextField | None = field(
        default=None,
        metadata={
            "doc": "an address for POST, as in `http: http://127.0.0.1:8080/time`; `https` if it is elsewhere"
        },
    )
    program: tuple[TextField, ...] = field(
        default=(), metadata={"doc": "a program and its arguments, as in `program: [/usr/bin/ask, --time]`"}
    )
    mcp: McpServer | None = field(default=None, metadata={"doc": "a tool of an MCP server"})
    token: TextField | None = field(
        default=None,
        metadata={"doc": "the environment variable that holds a bearer token for `http` or an MCP `url`"},
    )
    channel: Identifier | None = field(
        default=None,
        metadata={
            "doc": "the channel that a call uses, which a module needs permission for, as in "
            "`channel: internet`"
        },
    )
