"""Questions to the user at the terminal."""

from __future__ import annotations

import sys


def is_attended() -> bool:
    """Say if a user can be asked: in a script, standard input or error output is no terminal.

    Returns:
        True if both are terminals.
    """
    return sys.stdin.isatty() and sys.stderr.isatty()


def is_confirmed() -> bool:
    """Ask the user if what was shown is to be carried out.

    Returns:
        True for `yes` alone.
    """
    print("carry this out? yes or no: ", end="", file=sys.stderr, flush=True)
    return sys.stdin.readline().strip() == "yes"
