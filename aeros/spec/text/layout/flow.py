"""Layout of collections in brackets: on one line if they fit, else filled line by line."""

from __future__ import annotations

from typing import Final

from aeros.spec.text.layout.gaps import column_origin
from aeros.spec.text.nodes import MappingNode, Node, ScalarNode, SequenceNode

WIDTH: Final = 118
"""Limit on the characters of a line that collections in brackets are filled to."""


def is_in_brackets(node: Node) -> bool:
    """Tell if a value is a collection that is written in brackets.

    Args:
        node: a value that is in no other collection in brackets.

    Returns:
        True if it is.
    """
    return not isinstance(node, ScalarNode) and node.span.text[:1] in ("[", "{")


def must_stay(node: Node) -> bool:
    """Tell if a collection in brackets holds a comment, or a text over several lines.

    Args:
        node: the collection.

    Returns:
        True if its lines stay as they are.
    """
    scalars = _scalars_of(node)
    if any("\n" in one.span.text for one in scalars):
        return True
    text, at = node.span.source.text, node.span.start
    for one in scalars:
        if "#" in text[at : one.span.start]:
            return True
        at = one.span.end
    return "#" in text[at : node.span.end]


def on_one_line(node: Node) -> str:
    """Write a value on one line.

    Args:
        node: a value that need not stay as it is.

    Returns:
        The line.
    """
    if isinstance(node, ScalarNode):
        return "" if is_absent(node) else node.span.text
    opening, closing = _brackets(node)
    return opening + ", ".join(prefix + on_one_line(child) for prefix, child in _parts(node)) + closing


def fits(node: MappingNode | SequenceNode, column: int, comment: str) -> bool:
    """Tell if a collection fits on one line.

    Args:
        node: a collection that need not stay as it is.
        column: column of its first bracket.
        comment: comment behind it, with the space before it.

    Returns:
        True if it does, with the comment; where that is too long for any line, without it.
    """
    return column + len(on_one_line(node) + _shown(node, column, comment)) <= WIDTH


def lay_out(node: MappingNode | SequenceNode, column: int, hang: int, comment: str) -> list[str]:
    """Write a collection on one line or, if it does not fit, over several.

    Args:
        node: a collection that need not stay as it is.
        column: column of its first bracket.
        hang: column of its further lines.
        comment: comment behind it, with the space before it.

    Returns:
        Its lines without the comment; the first is not indented.
    """
    if fits(node, column, comment):
        return [on_one_line(node)]
    tail = _shown(node, column, comment)
    lines = _fill_lines(node, column, hang, tail)
    return [*lines[:-1], lines[-1].removesuffix(tail)]


def _shown(node: MappingNode | SequenceNode, column: int, comment: str) -> str:
    """The comment behind a collection, or no text if its line is too long in any case."""
    parts = _parts(node)
    last = parts[-1][0] + on_one_line(parts[-1][1]) if parts else ""
    return comment if column + len(f"[{last}]{comment}") <= WIDTH else ""


def _fill_lines(node: MappingNode | SequenceNode, column: int, hang: int, tail: str) -> list[str]:
    """Write a collection over several lines, as much on each as fits; what fits on one line is not broken.

    `tail` is what follows it: brackets and a comma, or a comment.
    """
    opening, closing = _brackets(node)
    lines = [opening]
    parts = _parts(node)
    for number, (prefix, child) in enumerate(parts):
        end = "," if number + 1 < len(parts) else closing + tail
        piece = prefix + on_one_line(child) + end
        gap = " " if number else ""
        used = len(lines[-1]) + (column if len(lines) == 1 else 0)
        if used + len(gap + piece) <= WIDTH:
            lines[-1] += gap + piece
            continue
        if number or (hang < used and hang + len(piece) <= WIDTH):
            lines.append(" " * hang)
        if isinstance(child, ScalarNode) or not _parts(child) or hang + len(piece) <= WIDTH:
            lines[-1] += piece
            continue
        lines[-1] += prefix
        used = len(lines[-1]) + (column if len(lines) == 1 else 0)
        first, *others = _fill_lines(child, used, used + 1, end)
        lines[-1] += first
        lines += others
    return lines if parts else [opening + closing + tail]


def move_lines(node: Node, column: int, least: int) -> list[str]:
    """Move the lines of a collection that stay as they are.

    Args:
        node: the collection.
        column: column of its first bracket.
        least: least column of its further lines.

    Returns:
        Its lines; the first is not indented.
    """
    start = node.span.start
    shift = column - (start - column_origin(node.span.source.text, start))
    first, *others = node.span.text.split("\n")
    lines = [first]
    for line in others:
        bare = line.lstrip(" \t")
        lines.append(" " * max(least, len(line) - len(bare) + shift) + bare if bare else "")
    return [line if line.rstrip(" \t").endswith("\\") else line.rstrip(" \t") for line in lines]


def is_absent(node: Node) -> bool:
    """Tell if nothing is written for a value, as after `key:`.

    Args:
        node: the value.

    Returns:
        True if there is no text for it.
    """
    return isinstance(node, ScalarNode) and not node.text and not node.style


def _brackets(node: MappingNode | SequenceNode) -> tuple[str, str]:
    return ("{", "}") if isinstance(node, MappingNode) else ("[", "]")


def _parts(node: MappingNode | SequenceNode) -> list[tuple[str, Node]]:
    """The parts of a collection, each with the text before it."""
    if isinstance(node, SequenceNode):
        return [("", item) for item in node.items]
    return [
        (key.span.text if is_absent(value) else f"{key.span.text}: ", value) for key, value in node.entries
    ]


def _scalars_of(node: Node) -> list[ScalarNode]:
    """The written texts in a value, in their order."""
    if isinstance(node, ScalarNode):
        return [] if is_absent(node) else [node]
    children = (
        node.items if isinstance(node, SequenceNode) else [one for entry in node.entries for one in entry]
    )
    return [scalar for child in children for scalar in _scalars_of(child)]
