"""A document as one HTML file that needs nothing else, from anywhere."""

from __future__ import annotations

import re
from collections.abc import Iterable
from html import escape
from typing import Final

from aeros.experiments.report.document import Block, Cell, Figure, Heading, Table, Words

_STYLE: Final = """\
body{font:14px/1.45 sans-serif;margin:2em auto;max-width:1200px;padding:0 1em;color:#222}
h1{font-size:1.5em}h2{font-size:1.15em;margin-top:2em;border-bottom:1px solid #ccc}
table{border-collapse:collapse;margin:1em 0;display:block;overflow-x:auto}
td,th{text-align:left;vertical-align:top;padding:2px 12px 2px 0;white-space:nowrap}
td{border-top:1px solid #eee}.off{color:#c62828;font-weight:bold}p{max-width:60em}
svg{max-width:100%;height:auto;display:block}summary{cursor:pointer;color:#1565c0}
"""


def as_html(blocks: Iterable[Block], title: str) -> str:
    """The page."""
    policy = "default-src 'none'; style-src 'unsafe-inline'"
    return "\n".join(
        [
            '<!DOCTYPE html><html lang="en"><head><meta charset="utf-8">',
            f'<meta http-equiv="Content-Security-Policy" content="{policy}">',
            f"<title>{escape(title)}</title><style>{_STYLE}</style></head><body>",
            *map(_block, blocks),
            "</body></html>",
            "",
        ]
    )


def _block(block: Block) -> str:
    match block:
        case Heading(level, text):
            return f"<h{level}>{escape(text)}</h{level}>"
        case Words(text):
            return f"<p>{_words(text)}</p>"
        case Table():
            return _table(block)
        case Figure(svg=svg):
            return svg


def _words(text: str) -> str:
    """Text in which `code` and *stress* are marked."""
    marked = re.sub(r"`([^`]+)`", r"<code>\1</code>", escape(text))
    return re.sub(r"\*([^*]+)\*", r"<em>\1</em>", marked)


def _table(table: Table) -> str:
    head = "".join(f"<th>{escape(one)}</th>" for one in table.head)
    rows = "".join("<tr>" + "".join(map(_cell, row)) + "</tr>" for row in table.rows)
    whole = f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"
    return f"<details><summary>{escape(table.folded)}</summary>{whole}</details>" if table.folded else whole


def _cell(cell: Cell) -> str:
    return f'<td class="off">{escape(cell.text)} ▲</td>' if cell.is_off else f"<td>{escape(cell.text)}</td>"
