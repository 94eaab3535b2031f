"""`aeros`: parses arguments, calls one command, and turns whatever happens into an exit code."""

from __future__ import annotations

import argparse
import errno
import importlib
import io
import os
import sys
import traceback
from collections.abc import Sequence
from typing import Final

import aeros
from aeros.exit_codes import EXIT_CODES, Exit, UsageError
from aeros.spec.diagnostics.errors import UndecidedError, UserError
from aeros.spec.diagnostics.render import escape_invisible, render_all

_COMMANDS: Final[dict[str, tuple[str, str]]] = {
    "verify": ("author.verify", "prove modules safe under a site's policy"),
    "prove": ("project.prove", "check the theorems about AEROS itself"),
    "run": ("run.run", "pursue an instruction on a plant"),
    "plan": ("author.plan", "plan for a goal by what skills declare, without running it"),
    "decide": ("run.decide", "decide action requests, one per line of JSON"),
    "diff": ("author.diff", "what a change newly allows and newly denies"),
    "audit": ("records.audit", "check, show and replay the record of a run"),
    "report": ("records.report", "write a finished run as one HTML page"),
    "why": ("records.why", "say why a run failed, a step was denied or the robot stopped"),
    "explain": ("author.explain", "explain a diagnostic code"),
    "graph": ("author.graph", "draw a task's planning rules, its closed loop or a composition"),
    "predict": ("author.predict", "compute a task's success probability and expected work exactly"),
    "experiment": ("project.experiment", "try architectures in many seeded trials, beside what is exact"),
    "memory": ("robot.memory", "show, search, export or forget what the agent remembers"),
    "bundle": ("robot.modules", "pack a module into one file"),
    "install": ("robot.modules", "keep a module on this robot"),
    "configure": ("robot.modules", "settle what an installed module needs around it"),
    "activate": ("robot.modules", "let a module's skills be dispatched"),
    "deactivate": ("robot.modules", "withdraw a module's skills"),
    "remove": ("robot.modules", "forget a module"),
    "list": ("robot.modules", "show what is installed on this robot"),
    "policy": ("robot.operator", "put a site file in force"),
    "block": ("robot.operator", "deny what a module, a skill or an action kind asks for"),
    "unblock": ("robot.operator", "take a block back"),
    "pause": ("robot.operator", "let nothing begin until it is resumed"),
    "resume": ("robot.operator", "let actions begin again"),
    "stop": ("robot.operator", "bring what moves to rest and end the run"),
    "release": ("robot.operator", "let an agent go on that was left in quarantine"),
    "top": ("run.top", "look on at a run from another terminal"),
    "mcp": ("connect.mcp", "let an MCP client look, propose plans, and have them executed"),
    "approve": ("robot.approve", "list and approve what clients of `aeros mcp` ask for"),
    "migrate": ("project.migrate", "rewrite files of older AEROS versions to the current format"),
    "new": ("author.new", "start a module that is proved and runs as it stands"),
    "schema": (
        "author.schema",
        "print the JSON Schema of manifests, site, people, faults and scene files, or reports",
    ),
}
"""Module below `aeros.cli` and summary of each command; a module is imported only to run a command of it."""

_SHARED_MODULES: Final = frozenset(("robot.modules", "robot.operator"))
"""Modules with several commands, which are told the name of theirs."""

_DISK_ERRNOS: Final = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EROFS})
"""What the system says of writing to a file that is open, without its name."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; never lets a traceback out unless AEROS_DEBUG is set."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # a terminal of another alphabet is no failure
    given = sys.argv[1:] if arguments is None else list(arguments)
    parsed = _parser(given).parse_args(given)
    try:
        return int(parsed.command(parsed))
    except UserError as error:
        print(render_all(error.diagnostics), file=sys.stderr)
        return Exit.UNDECIDED if isinstance(error, UndecidedError) else Exit.REJECTED
    except UsageError as error:
        print(f"aeros: {error}", file=sys.stderr)
        return Exit.USAGE
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return Exit.INTERRUPTED
    except BrokenPipeError:
        # The reader went away; nothing more can be said, and Python must not try at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return Exit.INTERRUPTED
    except Exception as error:
        if os.environ.get("AEROS_DEBUG"):
            traceback.print_exc()
        if isinstance(error, OSError) and (error.filename is not None or error.errno in _DISK_ERRNOS):
            place = "a file" if error.filename is None else f"`{escape_invisible(str(error.filename))}`"
            print(f"aeros: {place} cannot be used: {error.strerror}", file=sys.stderr)
            return Exit.REJECTED
        print(
            f"aeros: this is a bug in aeros, not in your files: {type(error).__name__}: {error}\n"
            "Please report it with the output of the same command under AEROS_DEBUG=1.",
            file=sys.stderr,
        )
        return Exit.INTERNAL_ERROR


def _parser(given: Sequence[str]) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="aeros",
        description="Capability packages proved safe before installation, actions decided before motion.",
        epilog=EXIT_CODES,
    )
    parser.add_argument("--version", action="version", version=f"aeros {aeros.__version__}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    wanted = next((word for word in given if word in _COMMANDS), None)
    for name, (module, summary) in _COMMANDS.items():
        if name == wanted:
            add_to = importlib.import_module(f"aeros.cli.{module}").add_to
            add_to(commands, name) if module in _SHARED_MODULES else add_to(commands)
        else:
            commands.add_parser(name, help=summary)
    return parser


if __name__ == "__main__":
    sys.exit(main())
