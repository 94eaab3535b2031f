"""Tools: services that carry out actions of some kinds.  `elaborate` builds them; the runtime calls them."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction


@dataclass(frozen=True)
class HttpService:
    """A service that is called with POST, a JSON object each way.

    Attributes:
        url: its address.
        token: environment variable that holds a bearer token; None for none.
    """

    url: str
    token: str | None = None


@dataclass(frozen=True)
class Confinement:
    """Rights of a program that the runtime starts, beyond the system's libraries and a folder of its own.

    Attributes:
        reads: absolute paths of files and folders that it may read and execute.
        writes: absolute paths of files and folders that it may also change.
        network: it may make sockets.
        memory: greatest memory, bytes.
        processor: greatest share of one core, above 0 and at most 1.
        processes: most processes at a time; where the kernel counts them, threads as well.
    """

    reads: tuple[str, ...] = ()
    writes: tuple[str, ...] = ()
    network: bool = False
    memory: int = 2**29
    processor: Fraction = Fraction(1)
    processes: int = 32


@dataclass(frozen=True)
class Program:
    """A program that is started for each call: JSON on its standard input, and on its standard output.

    Attributes:
        command: the program and its arguments.
        confinement: what it may use.
    """

    command: tuple[str, ...]
    confinement: Confinement = Confinement()


@dataclass(frozen=True)
class McpService:
    """A tool of a server of the Model Context Protocol.

    Attributes:
        tool: name of the tool.
        command: the program that serves on its standard input and output; empty if it has an address.
        url: address of a running server; empty if it is started.
        token: environment variable that holds a bearer token; None for none.
        confinement: what the program may use, if it is started.
    """

    tool: str
    command: tuple[str, ...] = ()
    url: str = ""
    token: str | None = None
    confinement: Confinement = Confinement()


@dataclass(frozen=True)
class Tool:
    """The service that carries out actions of one kind.

    Attributes:
        service: the service, and how it is reached.
        timeout: greatest real time of one call, s.
        answers: names of the state variables that an answer may set.
        channel: channel that a call uses, which a module needs permission for; None for none.
    """

    service: HttpService | Program | McpService
    timeout: Fraction
    answers: tuple[str, ...]
    channel: str | None = None
