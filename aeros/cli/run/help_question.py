"""Question to the person at the terminal before a task is given up: help and go on, or give up."""

from __future__ import annotations

import sys
from collections.abc import Callable

from aeros.cli.terminal.questions import is_attended


def help_asker() -> Callable[[str], bool] | None:
    """Make the function that asks for help.

    Returns:
        A function of the reason that returns True after Enter, and False after `q` or at the end of input;
        None in a script, where standard input or error output is no terminal.
    """
    return _ask if is_attended() else None


def _ask(reason: str) -> bool:
    print(f"aeros: I cannot go on: {reason}", file=sys.stderr)
    print("Help, step back and press Enter; or q to give up: ", end="", file=sys.stderr, flush=True)
    answer = sys.stdin.readline()
    return answer != "" and answer.strip().lower() not in ("q", "quit", "n", "no")
