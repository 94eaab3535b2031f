"""Blocks of a Markdown document."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from typing import Final

from aeros.experiments.report.figures import ReportFigure

OFF: Final = "▲"
"""Behind a value that is outside the interval of what was measured."""


@dataclass(frozen=True, slots=True)
class Block:
    """A heading, a paragraph, a table or a figure.

    Attributes:
        markdown: its text.
        collapsed_title: what is shown in its place until somebody opens it; empty for what is always shown.
        figure: the figure that the text refers to.
    """

    markdown: str
    collapsed_title: str = ""
    figure: ReportFigure | None = None


def heading(level: int, text: str) -> Block:
    """Make a heading; level 1 is the highest."""
    return Block(f"{'#' * level} {text}")


def table(head: Sequence[str], rows: Iterable[Sequence[str]], collapsed_title: str = "") -> Block:
    """Make a table of plain texts."""
    lines = [_table_row(head), "|" + "---|" * len(head), *map(_table_row, rows)]
    return Block("\n".join(lines), collapsed_title)


def _table_row(texts: Sequence[str]) -> str:
    return "| " + " | ".join(text.replace("|", "\\|") for text in texts) + " |"


def figure_block(figure: ReportFigure, folder: str) -> Block:
    """Refer to a figure whose file is in `folder`."""
    return Block(f"![{figure.title}]({folder}/{figure.name}.svg)", figure=figure)


def mark(text: str, is_outside_interval: bool) -> str:
    """Mark the text of a cell whose value is outside the interval of what was measured."""
    return f"{text} {OFF}" if is_outside_interval else text


def as_markdown(blocks: Iterable[Block]) -> str:
    """Join blocks to a document."""
    return "\n\n".join(map(_block_text, blocks)) + "\n"


def _block_text(block: Block) -> str:
    if not block.collapsed_title:
        return block.markdown
    # Without the empty lines a table inside would be read as HTML.
    title = escape(block.collapsed_title)
    return f"<details><summary>{title}</summary>\n\n{block.markdown}\n\n</details>"
