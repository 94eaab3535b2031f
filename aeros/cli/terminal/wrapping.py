"""Lines of a terminal: wrapped at its width, and coloured by rich, which is imported at first use."""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.text import Text

COLOUR: Final = re.compile(r"(\x1b\[(?:(?:[0-4]|3[0-79])(?:;(?:[0-4]|3[0-79]))*)?m)")
"""SGR sequence of a standard colour, of boldness and the like, or of their end.

Others, such as that for hidden text, are no output of ours, and so are escaped like any control character.
"""

LEAST_TEXT: Final = 24
"""Columns that text beside a name gets, or else it is written below the name."""

_PAGE_STYLES: Final = {
    "markdown.block_quote": "default",
    "markdown.code": "cyan",
    "markdown.h1": "bold",
    "markdown.h2": "bold",
    "markdown.h3": "bold",
    "markdown.item.number": "default",
    "markdown.link": "blue underline",
    "markdown.table.border": "default",
    "markdown.table.header": "bold",
}
"""Styles of Markdown; those of rich have backgrounds and bright colours."""

_MARKED: Final = re.compile(r"(?:note|help): ")
_FIRST_COLUMN: Final = re.compile(r" *\S(?:.*?\S)??  +(?=\S)")
_WORD: Final = re.compile(r" *[^ ]+ *")


def line_starts(plain: str, first: int, room: int, start: int = 0) -> list[int]:
    """Find where to break a text at blanks.

    A word that is wider than a line, such as a path, stays whole, so that it can be copied.

    Args:
        plain: text without colours.
        first: columns of the first line.
        room: columns of each further line.
        start: columns that are taken on the first line already.

    Returns:
        Offsets in `plain` at which further lines start.
    """
    from rich.cells import cell_len

    starts: list[int] = []
    width, used = first, start
    for found in _WORD.finditer(plain):
        word = found[0]
        if used and used + cell_len(word.rstrip(" ")) > width:
            word = word.lstrip(" ")
            starts.append(found.end() - len(word))
            width, used = room, 0
        used += cell_len(word)
    return starts


def wrap_line(line: str, width: int, start: int = 0) -> str:
    """Break a line at spaces so that it fits a terminal.

    Further lines begin below the text: below the second column where blanks separate columns, and two
    columns further in otherwise. A word that is wider than the terminal, such as a path, stays whole.

    Args:
        line: one line, whose only control sequences are colours.
        width: columns of the terminal.
        start: columns that are taken on the line already.

    Returns:
        The line, or several.
    """
    from rich.cells import cell_len

    line = line.expandtabs()
    plain = COLOUR.sub("", line)
    if start + cell_len(plain) <= width:
        return line
    indent = " " * _indent(plain.lstrip() if start else plain, width)
    starts = line_starts(plain, width, width - len(indent), start)
    return f"\n{indent}".join(_divided(line, plain, starts))


def _divided(line: str, plain: str, starts: Sequence[int]) -> list[str]:
    """Divide a line, whose text is `plain`, at offsets of its text; without blanks at the ends of parts."""
    if "\x1b" not in line:
        return [plain[at:end].rstrip() for at, end in pairwise((0, *starts, len(plain)))]
    parts = rich_text(line).divide(starts)
    for part in parts:
        part.rstrip()
    return [ansi_line(part) for part in parts]


def _indent(plain: str, width: int) -> int:
    """Return the columns before the further lines of a line that is wrapped."""
    if marked := _MARKED.match(plain):
        return len(marked[0])
    column = _FIRST_COLUMN.match(plain)
    if column is not None and len(column[0]) <= min(width // 2, width - LEAST_TEXT):
        return len(column[0])
    lead = len(plain) - len(plain.lstrip())
    return min(lead, width // 2) + 2


def rich_text(line: str) -> Text:
    """Make a text of rich of a line.

    Args:
        line: one line, whose only control sequences are colours.

    Returns:
        The text, with the colours; no part of it is taken for markup.
    """
    from rich.text import Text

    return Text.from_ansi(line) if "\x1b" in line else Text(line)


def ansi_line(text: Text) -> str:
    """Write a text of rich as a line.

    Args:
        text: the text.

    Returns:
        The line, with sequences for its colours.
    """
    return "".join(drawn_lines(text, max(1, text.cell_len))) if text.spans or text.style else text.plain


def drawn_lines(shown: RenderableType, width: int, *, is_coloured: bool = True) -> list[str]:
    """Draw something of rich.

    Args:
        shown: what to draw; it escapes text of others itself.
        width: columns to draw in.
        is_coloured: use colours.

    Returns:
        Its lines.
    """
    from rich.console import Console
    from rich.theme import Theme

    console = Console(
        file=io.StringIO(),
        width=width,
        color_system="standard" if is_coloured else None,
        force_terminal=is_coloured,
        no_color=not is_coloured,
        markup=False,
        emoji=False,
        highlight=False,
        legacy_windows=False,
        theme=Theme(_PAGE_STYLES),
        _environ={},
    )
    with console.capture() as captured:
        console.print(shown)
    return captured.get().rstrip("\n").split("\n")
