"""Text between two values of a YAML file: spaces, line breaks and comments."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

_SPACES: Final = re.compile(r"[ \t]*")


@dataclass(frozen=True, slots=True)
class GapLine:
    """A line without a value.

    Attributes:
        comment: its comment; no text if the line is blank.
        column: number of characters before the comment.
    """

    comment: str
    column: int


@dataclass(frozen=True, slots=True)
class Gap:
    """Spaces, line breaks and comments from one place to the next sign or value.

    Attributes:
        trailing: comment on the line on which the gap begins; no text if there is none.
        lines: the whole lines below it.
        end: offset of the next sign or value, or of the end of the text.
        breaks_line: the next sign or value is on a later line.
    """

    trailing: str
    lines: tuple[GapLine, ...]
    end: int
    breaks_line: bool

    @property
    def has_comment(self) -> bool:
        """True if a comment is in it."""
        return bool(self.trailing) or any(line.comment for line in self.lines)


def read_gap(text: str, start: int) -> Gap:
    r"""Read spaces, line breaks and comments.

    Args:
        text: text of the file, whose lines end with "\n".
        start: offset after a sign or a value; at the beginning of the file a comment is on a line of its own.

    Returns:
        The gap.
    """
    trailing = ""
    lines: list[GapLine] = []
    is_own_line = start == 0
    line_start = column_origin(text, start)
    at = start
    while True:
        at = _end_of_spaces(text, at)
        column = at - line_start
        comment = ""
        if text.startswith("#", at):
            end = text.find("\n", at)
            end = len(text) if end < 0 else end
            comment, at = text[at:end].rstrip(), end
        is_end_of_line = text.startswith("\n", at)
        if is_end_of_line or comment:
            if is_own_line:
                lines.append(GapLine(comment, column))
            else:
                trailing = comment
        if not is_end_of_line:
            return Gap(trailing, tuple(lines), at, breaks_line=is_own_line and start > 0)
        is_own_line = True
        at += 1
        line_start = at


def column_origin(text: str, offset: int) -> int:
    """Return the offset of the first character of a line.

    Args:
        text: text of the file.
        offset: offset of a character of the line.

    Returns:
        Offset of the line.
    """
    return text.rfind("\n", 0, offset) + 1


def _end_of_spaces(text: str, start: int) -> int:
    found = _SPACES.match(text, start)
    return start if found is None else found.end()
