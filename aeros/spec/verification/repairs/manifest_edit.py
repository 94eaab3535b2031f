"""Edits of a manifest: entries of mappings, items of lists and conditions; all other text stays as it is."""

from __future__ import annotations

import re
from typing import Final

from aeros.spec.diagnostics.codes import Diagnostics, Fix
from aeros.spec.diagnostics.source import Source, SourceSpan
from aeros.spec.text.nodes import MappingNode, Node, ScalarNode, SequenceNode
from aeros.spec.text.yaml_reader import read_yaml
from aeros.spec.verification.repairs.condition_text import conjoin_texts
from aeros.spec.verification.repairs.source_edit import AMBIGUOUS, edit_in_source

_COMMENT: Final = re.compile(r"(?:^|\s)#", re.MULTILINE)
_COMMENT_LINE: Final = re.compile(r"^\s*#", re.MULTILINE)
"""Comments, and what may be one: a text in a block can look like it."""


class ManifestEditor:
    """Editor of a manifest's text by the places of its nodes.

    Args:
        source: text of a manifest that can be read.
    """

    def __init__(self, source: Source) -> None:
        self.source = source
        self._root = read_yaml(source, Diagnostics())
        self._line_break = "\r\n" if "\r\n" in source.text else "\n"

    def node(self, *path: str | int) -> Node | None:
        """Find a node.

        Args:
            path: keys of mappings and positions in lists, from the root.

        Returns:
            The node; None if there is none.
        """
        found = self._root
        for part in path:
            if isinstance(found, MappingNode):
                found = next((value for key, value in found.entries if key.text == part), None)
            elif isinstance(found, SequenceNode) and isinstance(part, int) and part < len(found.items):
                found = found.items[part]
            else:
                return None
        return found

    def smallest_mapping(self, within: Node | None, span: SourceSpan, key: str) -> MappingNode | None:
        """Find the innermost mapping that has a key and holds a place.

        Args:
            within: node to search in.
            span: the place.
            key: the key.

        Returns:
            The mapping; None if there is none.
        """
        if within is None or not within.span.start <= span.start < _end_of(within):
            return None
        for child in _children(within):
            found = self.smallest_mapping(child, span, key)
            if found is not None:
                return found
        has_key = isinstance(within, MappingNode) and any(one.text == key for one, _ in within.entries)
        return within if has_key and isinstance(within, MappingNode) else None

    def add_entry(self, mapping: Node | None, key: str, value: str) -> Fix | None:
        """Add a key with a value at the end of a mapping.

        Args:
            mapping: the mapping.
            key: a key that it does not have.
            value: text of the value, without quotes.

        Returns:
            The edit; None if the node is no mapping that can be extended, or has the key.
        """
        if not isinstance(mapping, MappingNode) or any(one.text == key for one, _ in mapping.entries):
            return None
        return self._append(mapping, f"{key}: {quoted(value)}")

    def add_item(self, sequence: Node | None, text: str) -> Fix | None:
        """Add an item at the end of a list.

        Args:
            sequence: the list.
            text: text of the item.

        Returns:
            The edit; None if the node is no list that can be extended.
        """
        if not isinstance(sequence, SequenceNode):
            return None
        return self._append(sequence, text if self._is_flow(sequence) else f"- {text}")

    def add_list(self, mapping: Node | None, key: str, item: str) -> Fix | None:
        """Add a key with a list of one item at the end of a mapping.

        Args:
            mapping: the mapping.
            key: a key that it does not have.
            item: text of the item.

        Returns:
            The edit; None if the node is no mapping that can be extended, or has the key.
        """
        if not isinstance(mapping, MappingNode) or any(one.text == key for one, _ in mapping.entries):
            return None
        return self._append(mapping, f"{key}: [{item}]")

    def insert_item(self, sequence: Node | None, before: Node, text: str) -> Fix | None:
        """Insert an item into a list.

        Args:
            sequence: the list.
            before: the item before which it is to stand.
            text: text of the item.

        Returns:
            The edit; None if the item does not begin its line in a list of lines.
        """
        if not isinstance(sequence, SequenceNode) or before not in sequence.items or self._is_flow(sequence):
            return None
        line_start = self.source.text.rfind("\n", 0, before.span.start) + 1
        lead = self.source.text[line_start : before.span.start]
        if lead.strip() != "-":
            return None
        return Fix(
            SourceSpan(self.source, line_start, before.span.start), f"{lead}{text}{self._line_break}{lead}"
        )

    def empty_list(self, mapping: Node | None, key: str) -> Fix | None:
        """Replace a list by an empty one, where no comment would go with it.

        Args:
            mapping: the mapping that has it.
            key: its key.

        Returns:
            The edit; None if the node is no mapping with that list, or a comment stands in it.
        """
        entries = mapping.entries if isinstance(mapping, MappingNode) else ()
        name, listed = next((entry for entry in entries if entry[0].text == key), (None, None))
        if name is None or not isinstance(listed, SequenceNode):
            return None
        end = max(listed.span.end, _end_of(listed))
        text = self.source.text[name.span.end : end].rstrip()
        replaced = SourceSpan(self.source, name.span.end, name.span.end + len(text))
        return None if _COMMENT.search(text) else Fix(replaced, ": []")

    def remove_item(self, sequence: Node | None, number: int) -> Fix | None:
        """Remove an item of a list of lines with the comment behind it, or one of a list in brackets.

        Args:
            sequence: the list.
            number: position of an item that it has beside others.

        Returns:
            The edit; None if there is no other item, or this one shares its lines or has a comment within.
        """
        if not isinstance(sequence, SequenceNode) or len(sequence.items) < 2 or number >= len(sequence.items):
            return None
        items, text = sequence.items, self.source.text
        start, end = items[number].span.start, _end_of(items[number])
        if not self._is_flow(sequence):
            start = text.rfind("\n", 0, start) + 1
            if text[start : items[number].span.start].strip() != "-":
                return None
            end = text.find("\n", end) + 1 or len(text)
        elif number + 1 < len(items):
            end = items[number + 1].span.start
        else:
            start = _end_of(items[number - 1])
        comment = _COMMENT if self._is_flow(sequence) else _COMMENT_LINE
        return None if comment.search(text[start:end]) else Fix(SourceSpan(self.source, start, end), "")

    def remove_entry(self, mapping: Node | None, key: str) -> Fix | None:
        """Remove a key with its value, and the comment behind it; comments on other lines stay.

        Args:
            mapping: the mapping.
            key: a key that it has beside others.

        Returns:
            The edit; None if the node is no mapping with that key and another, or more than a line would go.
        """
        keys = [one.text for one, _ in mapping.entries] if isinstance(mapping, MappingNode) else []
        if not isinstance(mapping, MappingNode) or key not in keys or len(keys) < 2:
            return None
        number = keys.index(key)
        start, end = mapping.entries[number][0].span.start, _end_of(mapping.entries[number][1])
        text = self.source.text
        line_start = text.rfind("\n", 0, start) + 1
        if not self._is_flow(mapping) and not text[line_start:start].strip():
            start, end = line_start, text.find("\n", end) + 1 or len(text)
        elif number + 1 < len(keys):
            end = mapping.entries[number + 1][0].span.start
        else:
            start = _end_of(mapping.entries[number - 1][1])
        return None if "\n" in text[start:end].rstrip("\n") else Fix(SourceSpan(self.source, start, end), "")

    def conjoin(self, condition: Node | None, other: str) -> Fix | None:
        """Replace a condition by its conjunction with another.

        Args:
            condition: the condition.
            other: text of the other condition.

        Returns:
            The edit; None if it cannot be made where the condition stands.
        """
        if not isinstance(condition, ScalarNode):
            return None
        return self.replace(condition, conjoin_texts(" ".join(condition.text.split()), other))

    def replace(self, scalar: Node | None, text: str) -> Fix | None:
        """Replace the text of a scalar.

        Args:
            scalar: the scalar.
            text: its new text.

        Returns:
            The edit; None if it cannot be made where the scalar stands.
        """
        return edit_in_source(scalar.span, scalar.text, text) if isinstance(scalar, ScalarNode) else None

    def applied(self, fix: Fix) -> str:
        """Apply an edit.

        Args:
            fix: an edit of this text.

        Returns:
            The edited text of the manifest.
        """
        text = self.source.text
        return text[: fix.span.start] + fix.text + text[fix.span.end :]

    def _is_flow(self, node: Node) -> bool:
        return self.source.text[node.span.start] in "[{"

    def _append(self, collection: MappingNode | SequenceNode, text: str) -> Fix | None:
        children = _children(collection)
        if not children:
            inner = collection.span.start + 1
            return self._insertion(inner, text) if self._is_flow(collection) else None
        end = _end_of(children[-1])
        while self.source.text[end - 1].isspace():
            end -= 1
        if self._is_flow(collection):
            return self._insertion(end, f", {text}")
        line_end = self.source.text.find("\n", end)
        line = self.source.text[end:] if line_end < 0 else self.source.text[end:line_end]
        end += len(line.removesuffix("\r"))  # a comment stays with the line before
        first = collection.entries[0][0] if isinstance(collection, MappingNode) else collection.items[0]
        line_start = self.source.text.rfind("\n", 0, first.span.start) + 1
        indent = first.span.start - line_start
        if isinstance(collection, SequenceNode):
            indent = self.source.text.rfind("-", line_start, first.span.start) - line_start
        return self._insertion(end, f"{self._line_break}{' ' * indent}{text}") if indent >= 0 else None

    def _insertion(self, offset: int, text: str) -> Fix:
        before = self.source.text[offset - 1]  # an edit replaces some text, as its place is shown
        return Fix(SourceSpan(self.source, offset - 1, offset), before + text)


def quoted(text: str) -> str:
    """Quote a text where YAML would read it as something else.

    Args:
        text: text of a scalar, without quotes.

    Returns:
        The text, in double quotes if it needs them.
    """
    return f'"{text}"' if AMBIGUOUS.search(text) else text


def _children(node: Node) -> tuple[Node, ...]:
    if isinstance(node, MappingNode):
        return tuple(value for _, value in node.entries)
    return node.items if isinstance(node, SequenceNode) else ()


def _end_of(node: Node) -> int:
    """Return the offset after the last character of a node; a block ends with its last child."""
    children = _children(node)
    is_flow = node.span.text[:1] in ("[", "{")
    return node.span.end if is_flow or not children else _end_of(children[-1])
