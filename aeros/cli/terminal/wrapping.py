"""Lines of a terminal: wrapped at its width, and drawn by rich, which is imported at first use."""

from __future__ import annotations

import io
import re
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.text import Text

COLOUR: Final = re.compile(r"(\x1b\[[0-9;]*m)")
"""An SGR sequence: a colour, boldness, or the end of them."""

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
    from rich._wrap import divide_line  # `Text.wrap` would tear long words, and paths could not be copied
    from rich.cells import cell_len

    line = line.expandtabs()
    plain = COLOUR.sub("", line)
    if start + cell_len(plain) <= width:
        return line
    indent = " " * _indent(plain.lstrip() if start else plain, width)
    text = rich_text(line)
    pieces = divide_line(plain, width - start, fold=False)
    first, *others = text.divide(pieces[:1])
    if start and not pieces and cell_len(plain) <= width - len(indent):
        first, *others = text.divide([len(plain) - len(plain.lstrip())])  # all of it fits on the next line
    shown = [ansi_line(first)]
    for rest in others:
        within = divide_line(rest.plain, width - len(indent), fold=False)
        shown += [indent + ansi_line(part) for part in rest.divide(within)]
    return "\n".join(one.rstrip() for one in shown)


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
