"""Verification report as workflow commands of GitHub Actions, which mark the lines of a pull request.

A runner turns each command into an annotation. It shows ten of each severity for a step, so errors come
first. Escapes are those of `@actions/core`, which GitHub maintains.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

from aeros.cli.author.reports.result import (
    LocatedDiagnostic,
    VerifyResult,
    message_text,
    path_below_working_folder,
)
from aeros.spec.diagnostics.codes import CODES, Severity
from aeros.spec.diagnostics.render import escape_invisible

_COMMANDS: Final = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.NOTE: "notice"}
_DATA_ESCAPES: Final = (("%", "%25"), ("\r", "%0D"), ("\n", "%0A"))  # the sign of escapes is escaped first
_PROPERTY_ESCAPES: Final = (*_DATA_ESCAPES, (":", "%3A"), (",", "%2C"))


def as_github(result: VerifyResult) -> str:
    """Render the report as workflow commands.

    Args:
        result: Report and problems of certificates.

    Returns:
        A command on a line of its own for each diagnostic, those of errors first; empty without diagnostics.
    """
    order = list(_COMMANDS)
    problems = sorted(result.problems, key=lambda one: order.index(one.diagnostic.severity))
    return "\n".join(map(_command, problems))


def _command(problem: LocatedDiagnostic) -> str:
    diagnostic = problem.diagnostic
    properties = ",".join(f"{key}={_escape(value, _PROPERTY_ESCAPES)}" for key, value in _properties(problem))
    text = f"{CODES[diagnostic.code].slug}: {message_text(diagnostic)}"
    return f"::{_COMMANDS[diagnostic.severity]} {properties}::{_escape(text, _DATA_ESCAPES)}"


def _properties(problem: LocatedDiagnostic) -> Iterator[tuple[str, str]]:
    """Yield the place of a diagnostic, with columns only for a single line, as GitHub refuses others."""
    label = problem.diagnostic.primary
    if label is not None:
        span = label.span
        yield "file", _path(span.source.path)
        yield "line", str(span.line)
        if span.line == span.end_line:
            yield "col", str(span.column)
            yield "endColumn", str(span.end_column)
        yield "endLine", str(span.end_line)
    elif problem.path is not None:
        yield "file", _path(problem.path)
    yield "title", problem.diagnostic.code


def _path(path: str | Path) -> str:
    return escape_invisible(str(path_below_working_folder(Path(path))))


def _escape(text: str, escapes: tuple[tuple[str, str], ...]) -> str:
    for character, escaped in escapes:
        text = text.replace(character, escaped)
    return text
