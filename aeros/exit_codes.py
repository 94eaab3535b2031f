"""What the exit code of every command means."""

from __future__ import annotations

from enum import IntEnum

from aeros.spec.obligations.verdicts import Conclusion


class UsageError(Exception):
    """A command was asked for something that does not exist; it ends with `Exit.USAGE` and this message."""


class Exit(IntEnum):
    """Documented in docs/exit-codes.md and in every `--help`."""

    SUCCESS = 0  # or done, where a command proves nothing
    REJECTED = 1
    USAGE = 2
    UNDECIDED = 3
    INTERNAL_ERROR = 4
    INTERRUPTED = 130


def exit_for(conclusion: Conclusion) -> Exit:
    """The exit code of a report."""
    return {
        Conclusion.PROVED: Exit.SUCCESS,
        Conclusion.REJECTED: Exit.REJECTED,
        Conclusion.UNDECIDED: Exit.UNDECIDED,
    }[conclusion]


EXIT_CODES = (
    "exit codes: 0 proved or done, 1 rejected, 2 usage, 3 undecided, 4 a bug in aeros, 130 interrupted"
)
