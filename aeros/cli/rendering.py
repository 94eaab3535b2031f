"""Tables, wrapped lines, Markdown and colours for terminals, drawn by rich, which is imported at first use.

Only the eight standard colours are used, and no background, so that text can be read on dark and on light
terminals. Text of others is never taken for markup, emoji codes or values to highlight.
"""

from __future__ import annotations

import io
import re
import sys
from collections.abc import Collection, Iterable, Sequence
from typing import IO, TYPE_CHECKING, Any, ClassVar, Final

from aeros.cli.terminal import (
    COLOUR,
    escape_for_terminal,
    output_width,
    print_coloured,
    shows_colour,
)
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

_GAP: Final = 2
"""Blanks between two columns of a table."""

LABEL_COLUMNS: Final = 9
"""Width of the labels of lines that a command ends with."""

_LEAST_TEXT: Final = 24
"""Columns that the last column of a table gets, or else it is written below the others."""

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
    text = _text(line)
    pieces = divide_line(plain, width - start, fold=False)
    first, *others = text.divide(pieces[:1])
    if start and not pieces and cell_len(plain) <= width - len(indent):
        first, *others = text.divide([len(plain) - len(plain.lstrip())])  # all of it fits on the next line
    shown = [_ansi(first)]
    for rest in others:
        within = divide_line(rest.plain, width - len(indent), fold=False)
        shown += [indent + _ansi(part) for part in rest.divide(within)]
    return "\n".join(one.rstrip() for one in shown)


def _indent(plain: str, width: int) -> int:
    """Return the columns before the further lines of a line that is wrapped."""
    if marked := _MARKED.match(plain):
        return len(marked[0])
    column = _FIRST_COLUMN.match(plain)
    if column is not None and len(column[0]) <= min(width // 2, width - _LEAST_TEXT):
        return len(column[0])
    lead = len(plain) - len(plain.lstrip())
    return min(lead, width // 2) + 2


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

    cells = [[_text(_one_line(cell)) for cell in row] for row in rows]
    if not cells:
        return []
    count = len(cells[0])
    widths = [max(cell_len(row[place].plain) for row in cells) for place in range(count)]
    widths[: len(least)] = map(max, widths, least)
    before = sum(widths[:-1]) + _GAP * (count - 1)
    room = None if width is None else width - indent
    if room is not None and before + min(widths[-1], _LEAST_TEXT) > room:
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
    lines = _rendered(table, before + widths[-1] if room is None else room)
    return [f"{' ' * indent}{line}".rstrip() for line in lines]


def _stacked(rows: Iterable[Sequence[Text]], room: int, indent: int) -> list[str]:
    """Write rows whose columns do not fit beside each other: the first cell, and the others below it."""
    lines: list[str] = []
    for first, *others in rows:
        lines += wrap_line(" " * indent + _ansi(first), room + indent).split("\n")
        rest = "  ".join(_ansi(one) for one in others if one.plain)
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
    lines = _rendered(page, width, is_coloured=colour)
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


def _text(line: str) -> Text:
    """Make a text of rich of a line, with its colours."""
    from rich.text import Text

    return Text.from_ansi(line) if "\x1b" in line else Text(line)


def _ansi(text: Text) -> str:
    """Write a text of rich as a line with colours."""
    return "".join(_rendered(text, max(1, text.cell_len))) if text.spans or text.style else text.plain


def _rendered(shown: RenderableType, width: int, *, is_coloured: bool = True) -> list[str]:
    """Draw something of rich."""
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
