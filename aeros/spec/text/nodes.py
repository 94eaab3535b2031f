"""YAML nodes with their places: text, sequences and mappings, nothing interpreted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from aeros.spec.diagnostics.source import SourceSpan

_NULLS: Final = frozenset({"", "~", "null", "Null", "NULL"})


@dataclass(frozen=True, slots=True)
class ScalarNode:
    """One piece of text.

    Attributes:
        text: the text, without quotes.
        span: its place in the file.
        style: "" if plain, else the sign it opens with: ' " | >.
    """

    text: str
    span: SourceSpan
    style: str = ""

    @property
    def is_plain(self) -> bool:
        """True if no quotes or block sign mark the value as text."""
        return self.style == ""

    @property
    def is_null(self) -> bool:
        """True if YAML reads it as the absence of a value."""
        return self.is_plain and self.text in _NULLS


@dataclass(frozen=True, slots=True)
class SequenceNode:
    """List of values.

    Attributes:
        items: the values, in order.
        span: its place in the file.
    """

    items: tuple[Node, ...]
    span: SourceSpan


@dataclass(frozen=True, slots=True)
class MappingNode:
    """Keys with values; no two keys have the same text.

    Attributes:
        entries: pairs of key and value, in the order written.
        span: its place in the file.
    """

    entries: tuple[tuple[ScalarNode, Node], ...]
    span: SourceSpan


Node = ScalarNode | SequenceNode | MappingNode
