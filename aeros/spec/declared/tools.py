"""Schema of tools: action kinds of a site that a service carries out, and not the robot."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from aeros.spec.declared.field_types import Identifier
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.text.fields import BooleanField, IntegerField, TextField, ValueBounds


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
class Confinement:
    """Rights of a program that the runtime starts, beyond the system's libraries and a folder of its own.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    reads: tuple[TextField, ...] = field(
        default=(), metadata={"doc": "files and folders that it may read, as in `reads: [/opt/recipes]`"}
    )
    writes: tuple[TextField, ...] = field(
        default=(),
        metadata={"doc": "files and folders that it may also change, as in `writes: [/var/lib/cookbook]`"},
    )
    network: BooleanField | None = field(
        default=None, metadata={"doc": "`true` if it may make sockets; `false` if absent"}
    )
    memory: TextField | None = field(
        default=None, metadata={"doc": "its greatest memory, as in `memory: 1 GiB`; 512 MiB if absent"}
    )
    processor: TextField | None = field(
        default=None,
        metadata={"doc": "its largest share of one core, as in `processor: 50 %`; 100 % if absent"},
    )
    processes: Annotated[IntegerField, ValueBounds(1, 1000)] | None = field(
        default=None,
        metadata={
            "doc": "its most processes at a time; with control groups, threads count, too; 32 if absent"
        },
    )


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
    confinement: Confinement | None = field(
        default=None,
        metadata={
            "doc": "what the program of `program` or of an MCP `command` may use, as in "
            "`confinement: {reads: [/opt/recipes]}`"
        },
    )
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
