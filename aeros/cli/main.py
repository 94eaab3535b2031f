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

_COMMANDS = {
    "verify": "prove modules safe under a site's policy",
    "prove": "check the theorems about AEROS itself",
    "run": "pursue an instruction on a plant",
    "plan": "plan for a goal by what skills declare, without running it",
    "decide": "decide action requests, one per line of JSON",
    "diff": "what a change newly allows and newly denies",
    "audit": "check, show and replay the record of a run",
    "report": "write a finished run as one HTML page",
    "why": "say why a run failed, a step was denied or the robot stopped",
    "explain": "explain a diagnostic code",
    "graph": "draw a task's planning rules, its closed loop or a composition",
    "predict": "compute a task's success probability and expected work exactly",
    "experiment": "try architectures in many seeded trials, beside what is exact",
    "memory": "show, search, export or forget what the agent remembers",
    "bundle": "pack a module into one file",
    "install": "keep a module on this robot",
    "configure": "settle what an installed module needs around it",
    "activate": "let a module's skills be dispatched",
    "deactivate": "withdraw a module's skills",
    "remove": "forget a module",
    "list": "show what is installed on this robot",
    "policy": "put a site file in force",
    "block": "deny what a module, a skill or an action kind asks for",
    "unblock": "take a block back",
    "pause": "let nothing begin until it is resumed",
    "resume": "let actions begin again",
    "stop": "bring what moves to rest and end the run",
    "release": "let an agent go on that was left in quarantine",
    "top": "look on at a run from another terminal",
    "mcp": "let an MCP client look, propose plans, and have them executed",
    "approve": "list and approve what clients of `aeros mcp` ask for",
    "migrate": "rewrite files of older AEROS versions to the current format",
    "new": "start a module that is proved and runs as it stands",
    "schema": "print the JSON Schema of manifests, site, people, faults and scene files, or reports",
}
"""What each command does; the module of its name has the rest, and is imported only to run it."""

_SHARED_MODULES = {
    "modules": ("bundle", "install", "configure", "activate", "deactivate", "remove", "list"),
    "operator": ("policy", "block", "unblock", "pause", "resume", "stop", "release"),
}
"""Modules that have the rest of several commands."""

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
    for name, summary in _COMMANDS.items():
        family = next((family for family, names in _SHARED_MODULES.items() if name in names), None)
        if name == wanted and family is not None:
            importlib.import_module(f"aeros.cli.{family}").add_to(commands, name)
        elif name == wanted:
            importlib.import_module(f"aeros.cli.{name}").add_to(commands)
        else:
            commands.add_parser(name, help=summary)
    return parser


if __name__ == "__main__":
    sys.exit(main())
