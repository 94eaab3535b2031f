"""`aeros`: parse arguments, call one command, and map errors to exit codes."""

from __future__ import annotations

import errno
import io
import os
import sys
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from itertools import takewhile
from typing import Final

from aeros.cli.commands import COMMANDS
from aeros.cli.parsers import parse
from aeros.cli.terminal.rendering import print_diagnostics
from aeros.cli.terminal.streams import safe_streams
from aeros.exit_codes import Exit, UsageError
from aeros.spec.diagnostics.errors import UndecidedError, UserError
from aeros.spec.diagnostics.render import escape_invisible
from aeros.spec.migrations.renamed_options import RENAMED_OPTIONS

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
    # Matrices here are small, and threads of NumPy's linear algebra would only wait for each other.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
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
            return Exit.CLOSED_PIPE
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
    try:
        parsed = parse(given)
        if begin is not None:
            begin()
        return int(parsed.command(parsed))
    except UserError as error:
        print_diagnostics(error.diagnostics)
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
    command = next((word for word in given if word in COMMANDS), "")
    renamed = RENAMED_OPTIONS.get(command, {})
    names = (word.partition("=")[0] for word in takewhile(lambda word: word != "--", given))
    return next(((name, renamed[name]) for name in names if name in renamed), None)


if __name__ == "__main__":
    sys.exit(main())
