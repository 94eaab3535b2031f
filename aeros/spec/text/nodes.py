"""YAML nodes with their places: text, sequences and mappings, nothing interpreted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from aeros.spec.diagnostics.source import SourceSpan

_NULLS: Final = frozenset({"", "~", "null", "Null", "NULL"})


@dataclass(frozen=True, slots=True)
class ScalarNode:
    """One piece of text. `style` is "" if plain, else the sign it opens with: ' " | >."""

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
    """Values in order."""

    items: tuple[Node, ...]
    span: SourceSpan


@dataclass(frozen=True, slots=True)
class MappingNode:
    """Keys with values, in the order written; no two keys have the same text."""

    entries: tuple[tuple[ScalarNode, Node], ...]
    span: SourceSpan


Node = ScalarNode | SequenceNode | MappingNode
