"""Layout of texts over several lines: block texts, quoted and plain ones."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

from aeros.spec.text.nodes import ScalarNode

_HEADER: Final = re.compile(r"[|>](?:(?P<digit>[1-9])[+-]?|[+-](?P<late>[1-9])?)?(?=\s|$)")


@dataclass(frozen=True, slots=True)
class BlockText:
    """A block text in its layout.

    Attributes:
        header: its signs, with the comment behind them.
        lines: its lines, indented.
        end: offset after its last line in the file.
        keeps_end: the file ends with it, has no line break there, and would say something else with one.
    """

    header: str
    lines: tuple[str, ...]
    end: int
    keeps_end: bool


def lay_out_block_text(text: str, node: ScalarNode, parent: int, indent: int) -> BlockText:
    """Move a block text; its lines keep their indentation relative to each other.

    Args:
        text: text of the file.
        node: the block text.
        parent: column of the collection around it, in the file.
        indent: column of the collection around it, in the layout.

    Returns:
        The block text.
    """
    start = node.span.start
    first = _end_of_line(text, start)
    signs = _HEADER.match(text, start)
    signs_end = start + 1 if signs is None else signs.end()
    comment = text[signs_end:first].strip()
    header = text[start:signs_end] + (f" {comment}" if comment else "")
    lines = _lines_of(text, first, node.span.end)
    digit = None if signs is None else signs["digit"] or signs["late"]
    # An indentation that the header names counts from the collection around it.
    before = max(parent, 0) + int(digit) if digit else _indentation(lines)
    after = indent + (int(digit) if digit else 2)
    bare = [line[before:] if len(line) > before else "" for line in lines]
    keeps_blank_lines = "+" in text[start:signs_end]
    while bare and not bare[-1] and not keeps_blank_lines:
        bare.pop()
    end = first + sum(len(line) + 1 for line in lines[: len(bare)])
    is_open = end >= len(text) and bool(bare)
    moved = tuple(" " * after + line if line else "" for line in bare)
    return BlockText(header, moved, end, keeps_end=is_open and "-" not in text[start:signs_end])


def lay_out_flow_text(node: ScalarNode, indent: int) -> list[str]:
    """Indent a plain or quoted text over several lines; only its first line is not indented here.

    Args:
        node: the text.
        indent: column of each further line.

    Returns:
        Its lines.
    """
    first, *others = node.span.text.split("\n")
    lines = [first, *(" " * indent + bare if (bare := line.strip(" \t")) else "" for line in others)]
    last = lines.pop()
    return [*(_without_end(line, node.style) for line in lines), last]


def _without_end(line: str, style: str) -> str:
    """Delete spaces at the end of a line, unless a backslash makes them part of the text."""
    bare = line.rstrip(" \t")
    return line if style == '"' and bare.endswith("\\") else bare


def _lines_of(text: str, first: int, last: int) -> list[str]:
    """The lines after the header to that of the last content, and the blank lines below it."""
    lines: list[str] = []
    at = first
    while at + 1 < len(text):
        end = _end_of_line(text, at + 1)
        line = text[at + 1 : end]
        if at >= last and line.strip(" "):
            break
        lines.append(line)
        at = end
    return lines


def _indentation(lines: list[str]) -> int:
    """Indentation of the first line with content, or else of the longest line."""
    for line in lines:
        if line.strip(" "):
            return len(line) - len(line.lstrip(" "))
    return max(map(len, lines), default=0)


def _end_of_line(text: str, at: int) -> int:
    end = text.find("\n", at)
    return len(text) if end < 0 else end
