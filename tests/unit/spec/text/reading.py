"""YAML that is read in tests, and a law of the places inside scalars."""

from __future__ import annotations

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.source import Source
from aeros.spec.text.nodes import MappingNode, Node, ScalarNode, SequenceNode
from aeros.spec.text.scalar_positions import source_offsets
from aeros.spec.text.yaml_reader import read_yaml


def accepted(text: str) -> Node:
    sink = Diagnostics()
    node = read_yaml(Source("a.yaml", text), sink)
    assert list(sink) == []
    assert node is not None
    return node


def value_of(text: str) -> ScalarNode:
    """Return the value of the only key of a text."""
    node = accepted(text)
    assert isinstance(node, MappingNode)
    value = node.entries[0][1]
    assert isinstance(value, ScalarNode)
    return value


def check_offsets(node: Node) -> None:
    """Check that each offset points at its character, escaped or folded."""
    if isinstance(node, SequenceNode):
        for item in node.items:
            check_offsets(item)
    elif isinstance(node, MappingNode):
        for key, item in node.entries:
            check_offsets(key)
            check_offsets(item)
    else:
        offsets = source_offsets(node)
        assert len(offsets) in (0, len(node.text))
        assert offsets == sorted(offsets)
        source = node.span.source.text
        for character, offset in zip(node.text, offsets, strict=False):
            if source[offset] not in "\\\r\n":
                assert source[offset] == character
