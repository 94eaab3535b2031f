"""`aeros`: parse arguments, call one command, and map errors to exit codes."""

from __future__ import annotations

import argparse
import errno
import importlib
import io
import os
import sys
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from itertools import takewhile
from typing import Final

import aeros
from aeros.cli.terminal import print_diagnostics, safe_streams
from aeros.exit_codes import EXIT_CODES, Exit, UsageError
from aeros.spec.diagnostics.errors import UndecidedError, UserError
from aeros.spec.diagnostics.render import escape_invisible, render_all
from aeros.spec.migrations.renamed_options import RENAMED_OPTIONS

_COMMANDS: Final[dict[str, tuple[str, str]]] = {
    "verify": ("author.verify", "prove modules safe under a site's policy"),
    "prove": ("project.prove", "check the theorems about AEROS itself"),
    "run": ("run.run", "run an instruction on a plant"),
    "look": ("author.look", "run a module's perceivers once on a simulated scene, beside the truth"),
    "tasks": ("run.tasks", "list the tasks that can be asked for, or show how an instruction is understood"),
    "plan": ("author.plan", "plan for a goal from declared preconditions and outcomes, without running it"),
    "decide": ("run.decide", "decide action requests, one per line of JSON"),
    "test": ("author.site_tests.command", "compare decisions and verdicts with those that tests expect"),
    "diff": ("author.diff", "compare two policies: newly allowed and newly denied actions"),
    "audit": ("records.audit", "verify, show and replay the audit log of a run"),
    "report": ("records.report", "write a finished run as one HTML page"),
    "film": ("records.film", "make a film of a finished run"),
    "why": ("records.why", "explain why a run failed, a step was denied or the robot stopped"),
    "explain": ("author.explain", "explain a diagnostic code"),
    "graph": ("author.graph", "draw a task's planning rules, its closed loop or a composition"),
    "predict": ("author.predict", "compute a task's success probability and expected work exactly"),
    "experiment": ("project.experiment", "run seeded trials and compare them with exact predictions"),
    "world": ("robot.world", "show what the agent last saw, with its age, and where things usually are"),
    "memory": ("robot.memory", "show, search, export or delete the agent's memory"),
    "bundle": ("robot.modules", "pack a module into one file"),
    "install": ("robot.modules", "install a module on this robot"),
    "configure": ("robot.modules", "bind what an installed module needs, and set its parameters"),
    "activate": ("robot.modules", "activate a module so that its skills can run"),
    "deactivate": ("robot.modules", "deactivate a module so that none of its skills runs"),
    "remove": ("robot.modules", "uninstall a module"),
    "list": ("robot.modules", "list the modules installed on this robot"),
    "policy": ("robot.operator", "set the site policy, or show it"),
    "block": ("robot.operator", "deny all actions of a module, a skill or an action kind"),
    "unblock": ("robot.operator", "remove a block"),
    "repair": ("robot.operator", "put the registry's last recorded change in force again"),
    "pause": ("robot.operator", "pause: no new action starts until `aeros resume`"),
    "resume": ("robot.operator", "let actions start again"),
    "stop": ("robot.operator", "stop all motion and end the run"),
    "release": ("robot.operator", "lift the quarantine of a crashed agent"),
    "check-plant": ("robot.check_plant", "check that a plant keeps the promises of its interface"),
    "top": ("run.top", "show a live view of a run"),
    "mcp": ("connect.mcp", "serve the robot to MCP clients"),
    "approve": ("robot.approve", "list and approve requests of MCP clients"),
    "migrate": ("project.migrate", "rewrite files of older AEROS versions to the current format"),
    "site": ("author.site", "list the names of a site: volumes, cameras, variables, actions, limits"),
    "new": ("author.new", "create a new module from a template"),
    "schema": ("author.schema", "print the JSON Schema of the files that people write, and of reports"),
}
"""Module below `aeros.cli` and summary of each command; a module is imported only to run a command of it."""

_SHARED_MODULES: Final = frozenset(("robot.modules", "robot.operator"))
"""Modules with several commands; their `add_to` also gets the command's name."""

_STDERR: Final = 2  # file descriptor

_DISK_CURES: Final = {
    errno.ENOSPC: "make room on the disk",
    errno.EDQUOT: "make room within your quota",
    errno.EFBIG: "raise the limit of `ulimit -f`",
    errno.EIO: "check the disk",
    errno.EROFS: "give a folder that can be written to",
}
"""Cure by error number of writes to an open file, whose errors lack the file's name."""

_RESOURCE_ERRNOS: Final = frozenset({errno.EMFILE, errno.ENFILE, errno.ENOMEM, errno.EAGAIN, errno.ENOLCK})
"""Error numbers of a system that has no more files, memory, processes or locks to give."""


def main(arguments: Sequence[str] | None = None, *, begin: Callable[[], object] | None = None) -> int:
    """Run one command.  Tracebacks are printed only if AEROS_DEBUG is set.

    Args:
        arguments: Command line without the program's name; None for `sys.argv`.
        begin: Called once the command line is read, before the command does anything.

    Returns:
        The exit code.
    """
    _replace_closed_streams()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(
                errors="backslashreplace"
            )  # a terminal with another encoding must not cause a failure
    with safe_streams():
        try:
            try:
                return _run_command(sys.argv[1:] if arguments is None else list(arguments), begin)
            finally:
                # A pipe that is closed or a disk that is full shows here, and not when Python ends.
                sys.stdout.flush()
        except BrokenPipeError:
            # The reader, such as `head`, has all it wants, and Python must not flush into the pipe at exit.
            _drop_output()
            return Exit.INTERRUPTED
        except OSError as error:
            with suppress(OSError):
                _print_system_error(error)
                sys.stderr.flush()
            _drop_output()
            return Exit.REJECTED


def _drop_output() -> None:
    """Let the null device take what is still in the buffers of the standard streams."""
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _replace_closed_streams() -> None:
    """Put the null device in place of standard streams that are closed, for which Python has None."""
    closed = [name for name in ("stdin", "stdout", "stderr") if getattr(sys, name) is None]
    if closed:
        while (descriptor := os.open(os.devnull, os.O_RDWR)) <= _STDERR:
            pass  # so that no file gets the number of a standard stream
        os.close(descriptor)
    for name in closed:
        mode = "r" if name == "stdin" else "w"
        setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115  until the program ends


def _run_command(given: Sequence[str], begin: Callable[[], object] | None) -> int:
    for position, word in enumerate(given, start=1):
        if not _is_utf8(word):
            shown = escape_invisible(os.fsencode(word).decode("utf-8", "backslashreplace"))
            print(f"aeros: argument {position} is not UTF-8: `{shown}`", file=sys.stderr)
            return Exit.USAGE
    if (renamed := _renamed_option(given)) is not None:
        print(f"aeros: option `{renamed[0]}` was renamed; use `{renamed[1]}`", file=sys.stderr)
        return Exit.USAGE
    parsed = _parser(given).parse_args(given)
    try:
        if begin is not None:
            begin()
        return int(parsed.command(parsed))
    except UserError as error:
        print_diagnostics(render_all(error.diagnostics))
        return Exit.UNDECIDED if isinstance(error, UndecidedError) else Exit.REJECTED
    except UsageError as error:
        print(f"aeros: {error}", file=sys.stderr)
        return Exit.USAGE
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return Exit.INTERRUPTED
    except BrokenPipeError:
        raise
    except Exception as error:
        if os.environ.get("AEROS_DEBUG"):
            traceback.print_exc()
        if _follows_interrupt(error):
            print("interrupted", file=sys.stderr)
            return Exit.INTERRUPTED
        if _print_system_error(error):
            return Exit.REJECTED
        print(
            f"aeros: this is a bug in aeros, not in your files: {type(error).__name__}: {error}\n"
            "Please report it with the output of the same command under AEROS_DEBUG=1.",
            file=sys.stderr,
        )
        return Exit.INTERNAL_ERROR


def _is_utf8(text: str) -> bool:
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True


def _follows_interrupt(error: BaseException | None) -> bool:
    """Say if an error was raised while Ctrl-C was handled, as by a library that is half imported."""
    while error is not None:
        if isinstance(error, KeyboardInterrupt):
            return True
        error = error.__cause__ or error.__context__
    return False


def _print_system_error(error: Exception) -> bool:
    """Print an error of the operating system that no code of ours can cause; return False for others."""
    if not isinstance(error, OSError):
        return False
    if error.filename is None and error.errno in _RESOURCE_ERRNOS:
        print(f"aeros: the system has not enough resources: {error.strerror}", file=sys.stderr)
    elif error.filename is not None or error.errno in _DISK_CURES:
        place = "a file" if error.filename is None else f"`{escape_invisible(str(error.filename))}`"
        cure = f"; {_DISK_CURES[error.errno]}" if error.errno in _DISK_CURES else ""
        print(f"aeros: {place} cannot be used: {error.strerror}{cure}", file=sys.stderr)
    else:
        return False
    return True


def _renamed_option(given: Sequence[str]) -> tuple[str, str] | None:
    """Find an option that has another name now; return its old and its current name."""
    command = next((word for word in given if word in _COMMANDS), "")
    renamed = RENAMED_OPTIONS.get(command, {})
    names = (word.partition("=")[0] for word in takewhile(lambda word: word != "--", given))
    return next(((name, renamed[name]) for name in names if name in renamed), None)


def _parser(given: Sequence[str]) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="aeros",
        description="Capability packages proved safe before installation, actions decided before motion.",
        epilog=EXIT_CODES,
    )
    parser.add_argument("--version", action="version", version=f"aeros {aeros.__version__}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    wanted = next((word for word in given if word in _COMMANDS), None)
    # Only the help of `aeros` itself lists the others, which take longer to make than a small command to run.
    listed = {wanted: _COMMANDS[wanted]} if wanted is not None and given[0] == wanted else _COMMANDS
    for name, (module, summary) in listed.items():
        if name == wanted:
            add_to = importlib.import_module(f"aeros.cli.{module}").add_to
            add_to(commands, name) if module in _SHARED_MODULES else add_to(commands)
        else:
            commands.add_parser(name, help=summary)
    return parser


if __name__ == "__main__":
    sys.exit(main())
