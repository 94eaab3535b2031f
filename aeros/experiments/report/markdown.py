"""Blocks of a Markdown document."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from typing import Final

from aeros.experiments.report.figures import ReportFigure

OFF: Final = "▲"
"""Mark after a value that is outside the interval of the measured one."""


@dataclass(frozen=True, slots=True)
class Block:
    """A heading, a paragraph, a table or a figure.

    Attributes:
        markdown: its text.
        collapsed_title: shown in its place until it is opened; empty for a block that is always shown.
        figure: the figure that the text refers to.
    """

    markdown: str
    collapsed_title: str = ""
    figure: ReportFigure | None = None


def heading(level: int, text: str) -> Block:
    """Make a heading.

    Args:
        level: 1 for the highest.
        text: of the heading.

    Returns:
        The block.
    """
    return Block(f"{'#' * level} {text}")


def table(head: Sequence[str], rows: Iterable[Sequence[str]], collapsed_title: str = "") -> Block:
    """Make a table of plain texts.

    Args:
        head: titles of the columns.
        rows: texts of each row, one for each column.
        collapsed_title: shown in place of the table until it is opened; empty for a table that is always
            shown.

    Returns:
        The block.
    """
    lines = [_table_row(head), "|" + "---|" * len(head), *map(_table_row, rows)]
    return Block("\n".join(lines), collapsed_title)


def _table_row(texts: Sequence[str]) -> str:
    return "| " + " | ".join(text.replace("|", "\\|") for text in texts) + " |"


def figure_block(figure: ReportFigure, folder: str) -> Block:
    """Refer to a figure whose file is in a folder.

    Args:
        figure: the figure.
        folder: of its file, as the document names it.

    Returns:
        The block.
    """
    return Block(f"![{figure.title}]({folder}/{figure.name}.svg)", figure=figure)


def mark(text: str, is_outside_interval: bool) -> str:
    """Mark the text of a cell whose value is outside the interval of what was measured.

    Args:
        text: of the cell.
        is_outside_interval: True to mark it.

    Returns:
        The text, with `OFF` after it where it is marked.
    """
    return f"{text} {OFF}" if is_outside_interval else text


def as_markdown(blocks: Iterable[Block]) -> str:
    """Join blocks to a document.

    Args:
        blocks: in order.

    Returns:
        Markdown, which ends with a line break.
    """
    return "\n\n".join(map(_block_text, blocks)) + "\n"


def _block_text(block: Block) -> str:
    if not block.collapsed_title:
        return block.markdown
    # Without the empty lines a table inside would be read as HTML.
    title = escape(block.collapsed_title)
    return f"<details><summary>{title}</summary>\n\n{block.markdown}\n\n</details>"
