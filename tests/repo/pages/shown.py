"""Parser of commands that pages show: blocks ```console, each with the output that follows it."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

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


def run(command: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run it in `folder`; `tests.commands.server` runs `aeros` and `python FILE`."""
    path = os.pathsep.join((str(commands_folder()), str(Path(sys.executable).parent), os.environ["PATH"]))
    return subprocess.run(
        ["/bin/sh", "-c", command],
        cwd=folder,
        env={**os.environ, "PATH": path},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


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
