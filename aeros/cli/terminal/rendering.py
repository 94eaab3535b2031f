"""Tables, wrapped lines, Markdown and colours for terminals, drawn by rich, which is imported at first use.

Only the eight standard colours are used, and no background, so that text can be read on dark and on light
terminals. Text of others is never taken for markup, emoji codes or values to highlight.
"""

from __future__ import annotations

import sys
from collections.abc import Collection, Iterable, Sequence
from typing import IO, TYPE_CHECKING, Any, ClassVar, Final

from aeros.cli.terminal.streams import (
    escape_for_terminal,
    output_width,
    print_coloured,
    shows_colour,
)
from aeros.cli.terminal.wrapping import COLOUR, LEAST_TEXT, ansi_line, drawn_lines, rich_text, wrap_line
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.render import Paint, render_all

if TYPE_CHECKING:
    from rich.console import Console, RenderableType
    from rich.text import Text

_STYLES: Final = {
    "error": "bold red",
    "warning": "bold yellow",
    "note": "bold cyan",
    "help": "bold green",
    "gutter": "blue",
    "secondary": "blue",
    "good": "green",
    "bad": "bold red",
}
"""Styles of rich by the role of a text."""

_GAP: Final = 2
"""Blanks between two columns of a table."""

LABEL_COLUMNS: Final = 9
"""Width of the labels of lines that a command ends with."""


def table_lines(
    rows: Iterable[Sequence[str]],
    *,
    width: int | None,
    indent: int = 0,
    right: Collection[int] = (),
    least: Sequence[int] = (),
) -> list[str]:
    """Draw a table.

    Args:
        rows: texts by row, as many in each; text of others in them is escaped here, colours are kept.
        width: columns of the terminal, into which the last columns are wrapped; None to wrap nothing.
        indent: blanks before each line.
        right: numbers of the columns that are set to the right, such as those of numbers.
        least: widths that the first columns have at least, so that rows may be drawn one after the other.

    Returns:
        Its lines.
    """
    from rich.cells import cell_len
    from rich.table import Column, Table

    cells = [[rich_text(_one_line(cell)) for cell in row] for row in rows]
    if not cells:
        return []
    count = len(cells[0])
    widths = [max(cell_len(row[place].plain) for row in cells) for place in range(count)]
    widths[: len(least)] = map(max, widths, least)
    before = sum(widths[:-1]) + _GAP * (count - 1)
    room = None if width is None else width - indent
    if room is not None and before + min(widths[-1], LEAST_TEXT) > room:
        return _stacked(cells, room, indent)
    columns = [
        Column(
            justify="right" if place in right else "left",
            width=None if place == count - 1 else widths[place],
            overflow="fold",
        )
        for place in range(count)
    ]
    table = Table(*columns, box=None, show_header=False, padding=(0, _GAP, 0, 0), pad_edge=False)
    for row in cells:
        table.add_row(*row)
    lines = drawn_lines(table, before + widths[-1] if room is None else room)
    return [f"{' ' * indent}{line}".rstrip() for line in lines]


def _stacked(rows: Iterable[Sequence[Text]], room: int, indent: int) -> list[str]:
    """Write rows whose columns do not fit beside each other: the first cell, and the others below it."""
    lines: list[str] = []
    for first, *others in rows:
        lines += wrap_line(" " * indent + ansi_line(first), room + indent).split("\n")
        rest = "  ".join(ansi_line(one) for one in others if one.plain)
        lines += wrap_line(" " * (indent + 4) + rest, room + indent).split("\n") if rest else []
    return lines


def print_table(
    rows: Iterable[Sequence[str]],
    *,
    indent: int = 0,
    right: Collection[int] = (),
    least: Sequence[int] = (),
) -> None:
    """Print a table on standard output.

    Args:
        rows: texts by row, as many in each.
        indent: blanks before each line.
        right: numbers of the columns that are set to the right.
        least: widths that the first columns have at least.
    """
    lines = table_lines(rows, width=output_width(), indent=indent, right=right, least=least)
    if lines:
        print_coloured("\n".join(lines))


def print_labelled(label: str, text: str) -> None:
    """Print one of the lines that a command ends with, such as where its output is.

    Args:
        label: one short word.
        text: text of anybody.
    """
    print_table([(label, text)], least=(LABEL_COLUMNS,))


def markdown_text(text: str, width: int, *, colour: bool) -> str:
    """Draw a page of Markdown for a terminal.

    Args:
        text: the page.
        width: columns of the terminal.
        colour: use colours.

    Returns:
        Its lines.
    """
    from rich.markdown import CodeBlock, Heading, Markdown
    from rich.padding import Padding
    from rich.text import Text

    class PlainHeading(Heading):
        """A heading at the left, without a box around it."""

        def __rich_console__(self, console: Console, options: Any) -> Iterable[RenderableType]:
            self.text.justify = "left"
            yield self.text

    class PlainCode(CodeBlock):
        """A block of code on the terminal's own background."""

        def __rich_console__(self, console: Console, options: Any) -> Iterable[RenderableType]:
            yield Padding(Text(self.text.plain.rstrip()), (0, 0, 0, 4))

    class Page(Markdown):
        """A page without boxes and backgrounds."""

        elements: ClassVar = {
            **Markdown.elements,
            "heading_open": PlainHeading,
            "fence": PlainCode,
            "code_block": PlainCode,
        }

    page = Page(escape_for_terminal(text), hyperlinks=False)
    lines = drawn_lines(page, width, is_coloured=colour)
    return "\n".join(line.rstrip() for line in lines)


def painter(stream: IO[str], choice: str = "auto") -> Paint | None:
    """Return what colours texts for a stream.

    Args:
        stream: standard output or standard error.
        choice: `always` or `never`, whatever the environment says; `auto` for what `shows_colour` says.

    Returns:
        A function of a text and its role; None if the stream gets no colours.
    """
    return paint if shows_colour(stream, choice) else None


def paint(text: str, role: str) -> str:
    """Colour a text.

    Args:
        text: text that is escaped already.
        role: one of `error`, `warning`, `note`, `help`, `gutter`, `secondary`, `good` and `bad`.

    Returns:
        The text between sequences that begin and end its colours.
    """
    from rich.color import ColorSystem
    from rich.style import Style

    return Style.parse(_STYLES[role]).render(text, color_system=ColorSystem.STANDARD)


def print_diagnostics(diagnostics: Iterable[Diagnostic]) -> None:
    """Print diagnostics to standard error.

    Args:
        diagnostics: in the order to print.
    """
    into = sys.stderr
    print_coloured(render_all(diagnostics, paint=painter(into), width=output_width(into)), into)


def _one_line(cell: str) -> str:
    parts = COLOUR.split(cell)
    parts[::2] = (escape_for_terminal(one).replace("\n", "\\n").replace("\t", " ") for one in parts[::2])
    return "".join(parts)
