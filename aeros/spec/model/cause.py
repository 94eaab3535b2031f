"""Causes of a denial, halt or failure as data, for planners, for memory and for people."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any, Final

from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.expr.shortfall import UnmetBound


@dataclass(frozen=True, slots=True)
class Cause:
    """One reason for a denial, halt or failure.

    Attributes:
        kind: kind of obstacle, as `rule`, `hold` or `precondition`; `docs/supervision.md` lists them.
        rule: name of the invariant or skill, or of the subject of the reason.
        text: the condition as it is written, or the reason in words.
        source: authority for a rule of the site.
        location: file and line where it is written.
        shortfalls: parts of the condition that did not hold as required, with the measured values.
        code: code of the gate's reason.
    """

    kind: str
    rule: str
    text: str
    source: str = ""
    location: str = ""
    shortfalls: tuple[UnmetBound, ...] = ()
    code: str = ""

    def __str__(self) -> str:
        """As in `separation: human_distance is 0.41 m (at least 0.5 m)`."""
        return f"{self.rule}: " + (", ".join(map(str, self.shortfalls)) or self.text)


def file_and_line(span: SourceSpan) -> str:
    """Format the place of a span.

    Args:
        span: place in a file.

    Returns:
        `PATH:LINE`, with the line of the first character.
    """
    return f"{span.source.path}:{span.line}"


def causes_to_json(causes: Iterable[Cause]) -> list[dict[str, Any]]:
    """Convert causes for records.

    Args:
        causes: causes, in order.

    Returns:
        A JSON object for each, without its empty strings, under the field names of audit records.
    """
    return [
        {name: value for name, value in asdict(cause, dict_factory=_written).items() if value != ""}
        for cause in causes
    ]


_WRITTEN_NAMES: Final = {"location": "at", "required_op": "asked", "reason": "why"}
"""Names that records have for fields of `Cause` and `UnmetBound`, where they differ from the code's."""


def _written(fields: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    return {_WRITTEN_NAMES.get(name, name): value for name, value in fields}
