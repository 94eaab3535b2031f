"""Exit codes of the `aeros` commands."""

from __future__ import annotations

from enum import IntEnum

from aeros.spec.obligations.verdicts import Conclusion


class UsageError(Exception):
    """A request for something that does not exist; the command prints it and ends with `Exit.USAGE`."""


class Exit(IntEnum):
    """Exit codes of every command, documented in docs/exit-codes.md and in every `--help`."""

    SUCCESS = 0  # proved, or done if the command proves nothing
    REJECTED = 1
    USAGE = 2
    UNDECIDED = 3
    INTERNAL_ERROR = 4
    INTERRUPTED = 130
    CLOSED_PIPE = 141  # 128 and SIGPIPE, as shells count: the reader of the output closed it


def exit_for(conclusion: Conclusion) -> Exit:
    """Return the exit code for the conclusion of a report.

    Args:
        conclusion: the conclusion of a verification.

    Returns:
        SUCCESS if everything is proved, REJECTED if something is refuted or malformed, UNDECIDED if only the
        solver's budget ran out.
    """
    return {
        Conclusion.PROVED: Exit.SUCCESS,
        Conclusion.REJECTED: Exit.REJECTED,
        Conclusion.UNDECIDED: Exit.UNDECIDED,
    }[conclusion]


EXIT_CODES = (
    "exit codes: 0 proved or done, 1 rejected, 2 usage, 3 undecided, 4 a bug in aeros, 130 interrupted, "
    "141 output closed"
)
