r"""Source texts and places in them: offsets count characters; lines and columns start at 1.

A line ends at "\n" and nowhere else, so a place is the same in every editor, whatever other separators a file
holds.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, field
from functools import cached_property

from aeros.spec.diagnostics.errors import MisuseError


@dataclass(frozen=True, order=True)
class Source:
    """Text of a file.

    Attributes:
        path: path that messages show.
        text: the text.
    """

    path: str
    text: str = field(repr=False)

    @cached_property
    def _starts(self) -> list[int]:
        starts = [0]
        at = self.text.find("\n")
        while at >= 0:
            starts.append(at + 1)
            at = self.text.find("\n", at + 1)
        return starts

    @property
    def line_count(self) -> int:
        r"""Number of lines; an empty text has one, as has a text without any "\n"."""
        return len(self._starts)

    def position(self, offset: int) -> tuple[int, int]:
        """Convert an offset to line and column.

        Args:
            offset: offset of a character, or the length of the text.

        Returns:
            Line and column, both from 1.

        Raises:
            MisuseError: the offset is outside the text.
        """
        if not 0 <= offset <= len(self.text):
            raise MisuseError(f"offset {offset} is outside {self.path}")
        line = bisect_right(self._starts, offset)
        return line, offset - self._starts[line - 1] + 1

    def line_start(self, line: int) -> int:
        """Return the offset of a line.

        Args:
            line: number of the line, from 1.

        Returns:
            Offset of its first character.

        Raises:
            MisuseError: there is no such line.
        """
        if not 1 <= line <= self.line_count:
            raise MisuseError(f"{self.path} has no line {line}")
        return self._starts[line - 1]

    def line_text(self, line: int) -> str:
        r"""Return the text of a line.

        Args:
            line: number of the line, from 1.

        Returns:
            Its characters, without the line break ("\n" or "\r\n").

        Raises:
            MisuseError: there is no such line.
        """
        start = self.line_start(line)
        end = self._starts[line] - 1 if line < self.line_count else len(self.text)
        return self.text[start:end].removesuffix("\r")

    def span(self, start: int, end: int) -> SourceSpan:
        """Make a span of this text.

        Args:
            start: offset of the first character.
            end: offset after the last character.

        Returns:
            The span.

        Raises:
            MisuseError: an offset is outside the text, or `end` is before `start`.
        """
        return SourceSpan(self, start, end)


@dataclass(frozen=True, slots=True, order=True)
class SourceSpan:
    """Range of characters of a source.

    Attributes:
        source: the source.
        start: index of the first character.
        end: index after the last one; equal to `start` if it is empty.
    """

    source: Source
    start: int
    end: int

    def __post_init__(self) -> None:
        if not 0 <= self.start <= self.end <= len(self.source.text):
            raise MisuseError(f"no span {self.start}..{self.end} in {self.source.path}")

    @property
    def text(self) -> str:
        """Characters of the span."""
        return self.source.text[self.start : self.end]

    @property
    def line(self) -> int:
        """Line of the first character."""
        return self.source.position(self.start)[0]

    @property
    def column(self) -> int:
        """Column of the first character."""
        return self.source.position(self.start)[1]

    @property
    def end_line(self) -> int:
        """Line of the position just after the last character."""
        return self.source.position(self.end)[0]

    @property
    def end_column(self) -> int:
        """Column just after the last character."""
        return self.source.position(self.end)[1]

    def merge(self, other: SourceSpan) -> SourceSpan:
        """Return the smallest span that contains both.

        Args:
            other: another span of the same source.

        Returns:
            The span.

        Raises:
            MisuseError: `other` is of another source.
        """
        if other.source != self.source:
            raise MisuseError("spans of two sources have no common cover")
        return SourceSpan(self.source, min(self.start, other.start), max(self.end, other.end))

    def __str__(self) -> str:
        return f"{self.source.path}:{self.line}:{self.column}"
