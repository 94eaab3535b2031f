"""Parser of commands that pages show: blocks ```console, each with the output that follows it."""

from __future__ import annotations

import os
import pty
import re
import subprocess
import sys
import termios
import threading
from contextlib import suppress
from pathlib import Path
from typing import Final

from tests.commands.server import commands_folder

CONSOLE = re.compile(r"^```console\n(.*?)^```$", re.MULTILINE | re.DOTALL)

COMMAND = re.compile(r"^\$ (.+)\n((?:(?!\$ ).*\n)*)", re.MULTILINE)
"""A line `$ COMMAND`, and the lines up to the next one."""


def commands_of(page: str) -> list[tuple[str, str]]:
    """Every command of the page, and the output that is shown after it."""
    return [found for block in CONSOLE.findall(page) for found in COMMAND.findall(block)]


def numberless(text: str) -> list[str]:
    """Its lines, with every number, gap and underlining the same: the runs of two machines differ in them."""
    return [one for one in map(_without_numbers, text.splitlines()) if one]


def _without_numbers(line: str) -> str:
    zeros = re.sub(r"-?\d+(\.\d+)?", "0", line)
    return " ".join(re.sub(r"\^+|-{3,}", "^", zeros).split())


def shown_as_printed(shown: str, printed: str) -> str:
    """The lines of `shown` as they were printed, found in this order by all but their numbers."""
    lines = iter(printed.splitlines())
    found = []
    for line in shown.splitlines():
        wanted = _without_numbers(line)
        found.append(
            next((one for one in lines if _without_numbers(one) == wanted), line) if wanted else line
        )
    return "".join(f"{line.rstrip()}\n" for line in found)


_COLUMNS: Final = 120
"""Width of the terminal whose lines the pages show, as no line of a page is longer."""


def run(command: str, folder: Path, columns: int = _COLUMNS) -> subprocess.CompletedProcess[str]:
    """Run it in `folder`, in a terminal without colours; standard error is none, so no progress is shown.

    `tests.commands.server` runs `aeros` and `python FILE`.
    """
    path = os.pathsep.join((str(commands_folder()), str(Path(sys.executable).parent), os.environ["PATH"]))
    environment = {**os.environ, "PATH": path, "COLUMNS": str(columns), "NO_COLOR": "1", "TERM": "xterm"}
    terminal, output = pty.openpty()
    attributes = termios.tcgetattr(output)
    attributes[1] &= ~termios.OPOST  # line feeds stay as they are
    termios.tcsetattr(output, termios.TCSANOW, attributes)
    with subprocess.Popen(
        ["/bin/sh", "-c", command],
        cwd=folder,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=output,
        stderr=subprocess.PIPE,
    ) as process:
        os.close(output)
        printed: list[bytes] = []
        reader = threading.Thread(target=_read, args=(terminal, printed))
        reader.start()
        try:
            _, errors = process.communicate(timeout=300)
        except subprocess.TimeoutExpired:
            process.kill()
            raise
        reader.join()
        os.close(terminal)
    return subprocess.CompletedProcess(
        command, process.returncode, b"".join(printed).decode(), errors.decode(errors="backslashreplace")
    )


def _read(terminal: int, printed: list[bytes]) -> None:
    """Read until no process has the other end any more."""
    with suppress(OSError):
        while piece := os.read(terminal, 65536):
            printed.append(piece)


def carry_out(command: str, shown: str, folder: Path, *, refused: bool = False) -> str:
    """Run it: it prints every line of `shown`, in this order, and succeeds unless it is to be refused.

    Returns its output.
    """
    ran = run(command, folder)
    printed = iter(numberless(ran.stdout))
    missing = [line for line in numberless(shown) if line not in printed]
    assert not missing, f"$ {command}\n{ran.stdout}{ran.stderr}"
    assert (ran.returncode == 0) != refused, f"$ {command}\n{ran.stdout}{ran.stderr}"
    return ran.stdout + ran.stderr if refused else ran.stdout
