"""Why something was not done or was broken off, as data: for planners, for memory, and for people."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any, Final

from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.expr.shortfall import UnmetBound


@dataclass(frozen=True, slots=True)
class Cause:
    """One reason.

    kind: what stood in the way, as in `rule`, `hold` or `precondition`; `docs/supervision.md` lists them.
    rule: what it is called: an invariant, a skill, or what the reason is about.
    text: the condition as it is written, or the reason in words.
    source: on whose authority, where it is a rule of the site; at: the file and line where it is written.
    shortfalls: the parts of the condition that were not as required, with what was measured.
    code: of the gate's reason.
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
    """The file and line of something that is written."""
    return f"{span.source.path}:{span.line}"


def causes_to_json(causes: Iterable[Cause]) -> list[dict[str, Any]]:
    """Encode causes as JSON values for audit records, whose field names stay as they are."""
    return [
        {name: value for name, value in asdict(cause, dict_factory=_written).items() if value != ""}
        for cause in causes
    ]


_WRITTEN_NAMES: Final = {"location": "at", "required_op": "asked", "reason": "why"}
"""Names that records have for fields of `Cause` and `UnmetBound`, where they differ from the code's."""


def _written(fields: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    return {_WRITTEN_NAMES.get(name, name): value for name, value in fields}
