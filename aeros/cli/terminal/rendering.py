"""Tables, Markdown and colours for terminals, measured and drawn by rich, which is imported at first use.

Only the eight standard colours are used, and no background, so that text can be read on dark and on light
terminals. Text of others is never taken for markup, emoji codes or values to highlight.
"""

from __future__ import annotations

import sys
from collections.abc import Collection, Iterable, Sequence
from itertools import pairwise
from typing import IO, TYPE_CHECKING, Any, ClassVar, Final

from aeros.cli.terminal.streams import (
    escape_for_terminal,
    output_width,
    print_coloured,
    shows_colour,
)
from aeros.cli.terminal.wrapping import LEAST_TEXT, drawn_lines, line_starts, wrap_line
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.render import Paint, render_all

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

_STYLES: Final = {
    "error": "bold red",
    "warning": "bold yellow",
    "note": "bold cyan",
    "help": "bold green",
    "gutter": "bold blue",  # plain blue is hard to read on black
    "secondary": "bold blue",
    "good": "green",
    "bad": "bold red",
}
"""Styles of rich by the role of a text."""

_DIGITS: Final = 6
"""Significant digits of a number that people read."""

_GAP: Final = 2
"""Blanks between two columns of a table."""

LABEL_COLUMNS: Final = 9
"""Width of the labels of lines that a command ends with."""


Cell = str | tuple[str, str]
"""Text of a cell of a table, or the text and the role that colours it."""


def number_text(value: float) -> str:
    """Round a number for people.

    Args:
        value: the number.

    Returns:
        Its text with six significant digits; with fifteen if six would round a number below 1 up to 1.
    """
    text = f"{value:.{_DIGITS}g}"
    return f"{value:.15g}" if text == "1" and value < 1 else text


def table_lines(
    rows: Iterable[Sequence[Cell]],
    *,
    width: int | None,
    indent: int = 0,
    right: Collection[int] = (),
    least: Sequence[int] = (),
    paint: Paint | None = None,
) -> list[str]:
    """Draw a table.

    Args:
        rows: cells by row, as many in each; they are escaped here, so they may have text of others.
        width: columns of the terminal, into which the last columns are wrapped; None to wrap nothing.
        indent: blanks before each line.
        right: numbers of the columns that are set to the right, such as those of numbers.
        least: widths that the first columns have at least, so that rows may be drawn one after the other.
        paint: colours cells that have a role; None for no colours.

    Returns:
        Its lines; one for each row if nothing is wrapped.
    """
    from rich.cells import cell_len

    cells = [[(one, "") if isinstance(one, str) else one for one in row] for row in rows]
    cells = [[(_one_line(text), role) for text, role in row] for row in cells]
    if not cells:
        return []
    widths = [max(cell_len(text) for text, _ in column) for column in zip(*cells, strict=True)]
    widths[: len(least)] = map(max, widths, least)
    before = indent + sum(widths[:-1]) + _GAP * (len(widths) - 1)
    is_narrow = width is not None and before + min(widths[-1], LEAST_TEXT) > width
    lines: list[str] = []
    for row in cells:
        words = row[-1][0].split(" ")
        if width is not None and (is_narrow or max(map(cell_len, words)) > width - before):
            shown = [_painted(text, role, paint) for text, role in row if text]
            lines += _stacked(shown, width, indent)
            continue
        line = " " * indent
        for place, (text, role) in enumerate(row):
            blanks = " " * (widths[place] - cell_len(text))
            first, *others = [text] if place < len(row) - 1 else _pieces(text, width, before)
            shown_text = _painted(first, role, paint)
            line += blanks + shown_text if place in right else shown_text + blanks
            line += " " * _GAP
        lines.append(line.rstrip())
        lines += [" " * before + _painted(one, row[-1][1], paint) for one in others]
    return lines


def _painted(text: str, role: str, paint: Paint | None) -> str:
    return paint(text, role) if paint is not None and role and text else text


def _pieces(text: str, width: int | None, before: int) -> list[str]:
    """Break the text of a last column, which begins after `before` columns of a terminal."""
    if width is None:
        return [text]
    starts = line_starts(text, width - before, width - before)
    return [text[at:end].rstrip() for at, end in pairwise((0, *starts, len(text)))]


def _stacked(shown: Sequence[str], width: int, indent: int) -> list[str]:
    """Write a row whose cells do not fit beside each other: the first one, and the others below it."""
    if not shown:
        return [""]
    lines = wrap_line(" " * indent + shown[0], width).split("\n")
    rest = "  ".join(shown[1:])
    return lines + (wrap_line(" " * (indent + 4) + rest, width).split("\n") if rest else [])


def print_table(
    rows: Iterable[Sequence[Cell]],
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
    for line in table_lines(rows, width=output_width(), indent=indent, right=right, least=least):
        print(line)


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


def _one_line(text: str) -> str:
    return escape_for_terminal(text).replace("\n", "\\n").replace("\t", " ")
