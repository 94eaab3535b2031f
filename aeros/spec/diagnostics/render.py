"""Rendering of diagnostics as text for people or as plain data for programs; neither changes the content.

Text from a file is shown harmlessly: characters that move a cursor, reorder text or are invisible appear as
escapes, so a hostile manifest cannot write to the terminal that reports it.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from itertools import groupby
from textwrap import wrap
from typing import Any, Final

from aeros.spec.diagnostics.characters import escape_hidden
from aeros.spec.diagnostics.codes import CODES, Diagnostic, Severity, SpanLabel
from aeros.spec.diagnostics.source import Source, SourceSpan

LONGEST_LINE: Final = 160
"""Characters of a source line that are shown; a longer line is shown around its mark."""

_BLOCK: Final = re.compile(r"[|>][-+0-9]*\s*(#.*)?")  # header of a block scalar
_MAX_LINES: Final = 8  # of a text in a block that are shown
_LEAD: Final = 40  # characters shown before the mark in a shortened line
_LONGEST_TEXT: Final = 4000  # characters of a headline, label or note that are shown

Paint = Callable[[str, str], str]
"""Function of a text and its role that colours it; roles are `gutter`, `secondary`, and the words shown."""

_LEAST_LABEL: Final = 24
"""Columns that a label gets on however narrow a terminal."""


def render_all(
    diagnostics: Iterable[Diagnostic], *, paint: Paint | None = None, width: int | None = None
) -> str:
    """Render diagnostics as text.

    Args:
        diagnostics: diagnostics, in the order to show.
        paint: colours the text; None for no colours.
        width: columns of the terminal, into which marked lines must fit; None for no limit.

    Returns:
        Their texts, with an empty line between two.
    """
    return "\n".join(render_text(diagnostic, paint=paint, width=width) for diagnostic in diagnostics)


def render_text(diagnostic: Diagnostic, *, paint: Paint | None = None, width: int | None = None) -> str:
    """Render a diagnostic as lines for a terminal.

    Args:
        diagnostic: the diagnostic.
        paint: colours the text; None for no colours.
        width: columns of the terminal, into which marked lines must fit; None for no limit. Headline, notes
            and help are one line each: whatever writes them wraps them.

    Returns:
        Headline, marked source lines, notes and help; ends with a line break.
    """
    paint = paint or _plain
    severity = diagnostic.severity.value
    slug = CODES[diagnostic.code].slug
    rows = [
        f"{paint(f'{severity}[{diagnostic.code}]', severity)} {slug}: {escape_invisible(diagnostic.headline)}"
    ]
    rows += _snippets(diagnostic, paint, width)
    for word, texts in (("note", diagnostic.notes), ("help", diagnostic.help)):
        for text in texts:
            # Later lines are indented, so text cannot pose as the next diagnostic.
            lines = [escape_invisible(line) for line in text.split("\n")]
            rows.append(f"{paint(f'{word}:', word)} " + ("\n" + " " * 6).join(lines))
    return "\n".join(rows) + "\n"


def render_json(diagnostic: Diagnostic) -> dict[str, Any]:
    """Convert a diagnostic to data for `json.dumps`.

    Args:
        diagnostic: the diagnostic.

    Returns:
        Plain values. Texts are as they are; escaping is up to JSON.
    """
    return {
        "code": diagnostic.code,
        "slug": CODES[diagnostic.code].slug,
        "group": CODES[diagnostic.code].group,
        "severity": diagnostic.severity.value,
        "headline": diagnostic.headline,
        "primary": None if diagnostic.primary is None else _label_data(diagnostic.primary),
        "secondary": [_label_data(label) for label in diagnostic.secondary],
        "notes": list(diagnostic.notes),
        "help": list(diagnostic.help),
    }


def escape_invisible(text: str) -> str:
    """Replace every character that is not plainly visible by an escape.

    Args:
        text: any text.

    Returns:
        The harmless text, at most 4000 characters of it.
    """
    shown = "".join(escape_hidden(text[:_LONGEST_TEXT], _escape_character))
    return shown if len(text) <= _LONGEST_TEXT else shown + "…"


def _escape_character(character: str) -> str:
    if character == "\t":
        return "    "
    return character.encode("unicode_escape").decode("ascii")


def _label_data(label: SpanLabel) -> dict[str, Any]:
    span = label.span
    return {
        "path": span.source.path,
        "line": span.line,
        "column": span.column,
        "end_line": span.end_line,
        "end_column": span.end_column,
        "start": span.start,
        "end": span.end,
        "text": label.text,
    }


def _plain(text: str, role: str) -> str:
    return text


@dataclass(frozen=True, slots=True)
class _LabelMark:
    """Mark of one label on its first line: offsets within the line, the sign drawn, its colour."""

    start: int
    end: int
    sign: str
    role: str
    text: str


class _Row:
    """Cells of one row under a source line, each with the role that colours it."""

    def __init__(self) -> None:
        self._cells: list[tuple[str, str]] = []

    def put(self, column: int, text: str, role: str) -> None:
        self._cells += [(" ", "")] * (column + len(text) - len(self._cells))
        self._cells[column : column + len(text)] = [(character, role) for character in text]

    def to_text(self, paint: Paint) -> str:
        runs = groupby(self._cells, key=lambda cell: cell[1])
        texts = ((role, "".join(character for character, _ in cells)) for role, cells in runs)
        return "".join(paint(text, role) if role else text for role, text in texts)


def _snippets(diagnostic: Diagnostic, paint: Paint, screen: int | None) -> list[str]:
    """Render the location line and the marked source lines, the primary label's file first."""
    if diagnostic.primary is None:
        labels = [(label, False) for label in diagnostic.secondary]
    else:
        labels = [(diagnostic.primary, True), *((label, False) for label in diagnostic.secondary)]
    marks: dict[Source, dict[int, list[_LabelMark]]] = {}
    places: dict[Source, SourceSpan] = {}
    for label, is_primary in labels:
        places.setdefault(label.span.source, label.span)
        role = _role(diagnostic.severity, is_primary)
        for line, mark in _marks(label, "^" if is_primary else "-", role):
            marks.setdefault(label.span.source, {}).setdefault(line, []).extend(mark)
    width = max((len(str(line)) for lines in marks.values() for line in lines), default=0)
    rows: list[str] = []
    for source, place in places.items():
        rows.append(_location(place, ":::" if rows else "-->", width, paint))
        rows += _marked_lines(source, marks[source], width, paint, screen)
    return rows


def _role(severity: Severity, is_primary: bool) -> str:
    return severity.value if is_primary else "secondary"


def _location(span: SourceSpan, arrow: str, width: int, paint: Paint) -> str:
    place = f"{escape_invisible(span.source.path)}:{span.line}:{span.column}"
    return f"{' ' * width}{paint(arrow, 'gutter')} {place}"


def _marks(label: SpanLabel, sign: str, role: str) -> list[tuple[int, list[_LabelMark]]]:
    """Place the marks of a label on its first line or, for a block scalar, on each line of its text.

    Nothing is drawn below the first line of other labels.
    """
    span = label.span
    line_start = span.source.line_start(span.line)
    first = span.source.line_text(span.line)
    start, end = span.start - line_start, min(span.end - line_start, len(first))
    if not _BLOCK.fullmatch(first, start):
        return [(span.line, [_LabelMark(start, max(start, end), sign, role, escape_invisible(label.text))])]
    marks: list[tuple[int, list[_LabelMark]]] = []
    for line in range(span.line + 1, span.end_line + 1):
        text = span.source.line_text(line).rstrip()
        start, end = len(text) - len(text.lstrip()), span.end - span.source.line_start(line)
        if start < min(len(text), end) and len(marks) < _MAX_LINES:
            marks.append((line, [_LabelMark(start, min(len(text), end), sign, role, "")]))
    if marks:
        marks[-1][1][0] = replace(marks[-1][1][0], text=escape_invisible(label.text))
    return [(span.line, []), *marks]


def _marked_lines(
    source: Source, marks: dict[int, list[_LabelMark]], width: int, paint: Paint, screen: int | None
) -> list[str]:
    rows: list[str] = []
    previous = None
    room = None if screen is None else max(screen - width - len(" | "), _LEAST_LABEL)
    for line in sorted(marks):
        if previous is not None and line > previous + 1:
            rows.append(paint("...", "gutter"))
        shown, columns = _window(source.line_text(line), marks[line], room)
        rows.append(f"{paint(f'{line:>{width}} |', 'gutter')} {shown}".rstrip())
        gutter = paint(f"{'':>{width}} |", "gutter")
        if marks[line]:
            rows += [f"{gutter} {row.to_text(paint)}" for row in _rows_below(marks[line], columns, room)]
        previous = line
    return rows


def _window(text: str, marks: list[_LabelMark], room: int | None) -> tuple[str, Callable[[int], int]]:
    """Cut out the part of a line to show, made safe; map each offset of it to its column on the screen."""
    low, high, most = 0, len(text), LONGEST_LINE
    if room is not None and _columns(escape_hidden(text[:most], _escape_character)) > room:
        most = min(most, room - len("……"))
    if high > most:
        low = max(0, min((marks[0].start if marks else 0) - min(_LEAD, most // 4), high - most))
        high = low + most
    parts = escape_hidden(text[low:high], _escape_character)
    while room is not None and high > low + 1 and _columns(parts) > room - len("……"):
        high -= 1
        parts.pop()
    before, after = "…" if low > 0 else "", "…" if high < len(text) else ""
    columns = [len(before)]
    for part in parts:
        columns.append(columns[-1] + sum(map(_width, part)))
    return f"{before}{''.join(parts)}{after}", lambda offset: columns[min(max(offset, low), high) - low]


def _columns(parts: Iterable[str]) -> int:
    return sum(_width(character) for part in parts for character in part)


def _width(character: str) -> int:
    """Return the columns that a terminal gives to one character that is already safe."""
    if unicodedata.category(character) in ("Mn", "Me"):
        return 0
    return 2 if unicodedata.east_asian_width(character) in "WF" else 1


def _rows_below(marks: list[_LabelMark], column_of: Callable[[int], int], room: int | None) -> list[_Row]:
    """Draw the row of carets and dashes with the last label on it, then rows for each other label."""
    placed = [(column_of(m.start), max(column_of(m.end), column_of(m.start) + 1), m) for m in marks]
    first = _Row()
    for start, end, mark in sorted(placed, key=lambda item: item[2].sign == "^"):  # carets over dashes
        first.put(start, mark.sign * (end - start), mark.role)
    waiting = sorted((item for item in placed if item[2].text), key=lambda item: item[0])
    furthest = max(end for _, end, _ in placed)
    if waiting and waiting[-1][1] == furthest:
        _, end, mark = waiting[-1]
        if room is None or end + 1 + len(mark.text) <= room:
            first.put(end + 1, mark.text, mark.role)
            waiting.pop()
    rows = [first]
    while waiting:
        start, _, mark = waiting.pop()
        # Near the right border, a label stands further left, below its mark.
        column = start if room is None else max(0, min(start, room - min(len(mark.text), _LEAST_LABEL)))
        texts = [mark.text] if room is None else wrap(mark.text, room - column, break_on_hyphens=False)
        for text in texts:
            row = _Row()
            for left, _, other in waiting:
                if left < column:
                    row.put(left, "|", other.role)
            row.put(column, text, mark.role)
            rows.append(row)
    return rows
