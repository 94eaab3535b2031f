"""A document as Markdown, its figures as files beside it."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape

from aeros.experiments.report.document import Block, Cell, Figure, Heading, Table, Words


def as_markdown(blocks: Iterable[Block], figures: str, below: int = 0) -> str:
    """The text.

    figures: the folder that its figures are in, as the text names it.
    below: the level of the heading that it stands under.
    """
    return "\n\n".join(_block(block, figures, below) for block in blocks) + "\n"


def _block(block: Block, figures: str, below: int) -> str:
    match block:
        case Heading(level, text):
            return f"{'#' * (level + below)} {text}"
        case Words(text):
            return text
        case Table():
            return _table(block)
        case Figure(name=name, title=title):
            return f"![{title}]({figures}/{name}.svg)"


def _table(table: Table) -> str:
    lines = [_line(table.head), "|" + "---|" * len(table.head)]
    lines += [_line(tuple(map(_text, row))) for row in table.rows]
    whole = "\n".join(lines)
    if not table.folded:
        return whole
    # Without the empty lines the table inside would be read as HTML.
    return f"<details><summary>{escape(table.folded)}</summary>\n\n{whole}\n\n</details>"


def _text(cell: Cell) -> str:
    return f"{cell.text} ▲" if cell.is_off else cell.text


def _line(texts: tuple[str, ...]) -> str:
    return "| " + " | ".join(text.replace("|", "\\|") for text in texts) + " |"
