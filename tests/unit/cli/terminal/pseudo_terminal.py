"""A pseudo terminal in which commands run, to see what a person at a terminal sees."""

from __future__ import annotations

import fcntl
import os
import pty
import struct
import sys
import termios
import threading
from collections.abc import Callable
from contextlib import suppress
from unittest.mock import patch

from aeros.cli.main import main


def run_in_terminal(
    arguments: list[str], columns: int, *, standard_error: bool = True, run: Callable[[list[str]], int] = main
) -> str:
    """Run a command whose standard output is a terminal.

    Args:
        arguments: of `aeros`.
        columns: width of the terminal.
        standard_error: standard error is that terminal, too.
        run: is called with the arguments.

    Returns:
        Everything that was written to the terminal, with line feeds alone at the ends of lines.
    """
    master, slave = pty.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 40, columns, 0, 0))
    pieces: list[bytes] = []

    def read() -> None:
        with suppress(OSError):  # the other end is closed
            while piece := os.read(master, 65536):
                pieces.append(piece)

    reader = threading.Thread(target=read)
    reader.start()
    terminal = open(slave, "w", encoding="utf-8", buffering=1)  # noqa: SIM115  closed below
    environment = {"TERM": "xterm-256color", "COLUMNS": str(columns)}
    try:
        with patch.dict(os.environ, environment), patch.object(sys, "stdout", terminal):
            for name in ("NO_COLOR", "FORCE_COLOR"):
                os.environ.pop(name, None)
            with (
                patch.object(sys, "stderr", terminal if standard_error else sys.stderr),
                suppress(SystemExit),
            ):
                run(arguments)
            terminal.flush()
    finally:
        terminal.close()
        reader.join()
        os.close(master)
    return b"".join(pieces).decode("utf-8").replace("\r\n", "\n")
