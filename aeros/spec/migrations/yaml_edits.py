"""Edits of YAML text at the places of its nodes. Comments, quotes, layout and all other bytes stay."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.diagnostics.source import Source, SourceSpan
from aeros.spec.migrations.format import Step, UnmigratableError
from aeros.spec.text.nodes import MappingNode, Node, ScalarNode, SequenceNode
from aeros.spec.text.yaml_reader import read_yaml

EACH = "*"
"""In a path: every entry of a mapping or list."""

_QUOTES = ("'", '"')


def parse(text: str, path: str = "") -> Node:
    """Parse YAML text.

    Args:
        text: YAML.
        path: file that error messages name.

    Returns:
        The root node.

    Raises:
        UserError: `text` is not well-formed.
    """
    diagnostics = Diagnostics()
    node = read_yaml(Source(path, text), diagnostics)
    if node is None:
        raise UserError(diagnostics)
    return node


def rename_key(text: str, path: Sequence[str], new: str) -> str:
    """Rename a key wherever a path leads to it.

    Args:
        text: YAML.
        path: keys from the top to the one to rename; `EACH` stands for every entry of a mapping or list.
        new: the new name, a plain word.

    Returns:
        The edited text.

    Raises:
        UnmigratableError: the new name is written in the same mapping already.
        UserError: `text` is not well-formed.
    """
    *above, old = path
    edits = []
    for node in _nodes_at(parse(text), above):
        keys = {key.text: key for key, _ in node.entries} if isinstance(node, MappingNode) else {}
        if old in keys and new in keys:
            raise UnmigratableError(f"`{old}` becomes `{new}`, which line {keys[new].span.line} has already")
        if old in keys:
            edits.append((keys[old].span, _quoted_like(keys[old], new)))
    return _edited(text, edits)


def rename_keys_below(text: str, path: Sequence[str], names: tuple[str, str], *, values_but: str) -> str:
    """Rename a key with a single value at any depth below the places that a path leads to.

    Args:
        text: YAML.
        path: keys from the top, as in `rename_key`.
        names: the old name and the new one, plain words.
        values_but: the value with which the key keeps its name.

    Returns:
        The edited text; mappings under a key `inputs` are left alone, as users choose their keys.

    Raises:
        UnmigratableError: the new name is written in the same mapping already.
        UserError: `text` is not well-formed.
    """
    old, new = names
    edits = []
    for node in (inner for top in _nodes_at(parse(text), path) for inner in _mappings_below(top)):
        entries = {key.text: (key, value) for key, value in node.entries}
        key, value = entries.get(old, (None, None))
        if key is None or not isinstance(value, ScalarNode) or value.text == values_but:
            continue
        if new in entries:
            line = entries[new][0].span.line
            raise UnmigratableError(f"`{old}` becomes `{new}`, which line {line} has already")
        edits.append((key.span, _quoted_like(key, new)))
    return _edited(text, edits)


def set_value(text: str, path: Sequence[str], new: str, *, of: frozenset[str] | None = None) -> str:
    """Replace a single value wherever a path leads to one.

    Args:
        text: YAML.
        path: keys from the top to the key of the value, as in `rename_key`.
        new: the new value, a plain word.
        of: values that are replaced; None for any.

    Returns:
        The edited text.

    Raises:
        UserError: `text` is not well-formed.
    """
    nodes = [
        node
        for node in _nodes_at(parse(text), path)
        if isinstance(node, ScalarNode) and (of is None or node.text in of)
    ]
    return _edited(text, [(node.span, _quoted_like(node, new)) for node in nodes])


def yaml_step(schema: str, edit: Step) -> Step:
    """Make a migration step from an edit of the text.

    Args:
        schema: value of `schema` in the version that the step leads to, `aeros/ecm/2`.
        edit: rewrites everything else.

    Returns:
        A step that does the edit and sets `schema`.
    """
    return lambda text: set_value(edit(text), ["schema"], schema)


def schema_of(text: str, path: str = "") -> tuple[str, SourceSpan] | None:
    """Find the value of `schema` at the top of a document.

    Args:
        text: YAML.
        path: file that error messages name.

    Returns:
        The value and its place; None if there is none.

    Raises:
        UserError: `text` is not well-formed.
    """
    for node in _nodes_at(parse(text, path), ["schema"]):
        if isinstance(node, ScalarNode):
            return node.text, node.span
    return None


def _nodes_at(node: Node, path: Sequence[str]) -> Iterator[Node]:
    if not path:
        yield node
        return
    head, *rest = path
    if isinstance(node, MappingNode):
        inner = [value for key, value in node.entries if head in (EACH, key.text)]
    else:
        inner = list(node.items) if isinstance(node, SequenceNode) and head == EACH else []
    for child in inner:
        yield from _nodes_at(child, rest)


def _mappings_below(node: Node) -> Iterator[MappingNode]:
    if isinstance(node, MappingNode):
        yield node
        for key, value in node.entries:
            if key.text != "inputs":
                yield from _mappings_below(value)
    elif isinstance(node, SequenceNode):
        for item in node.items:
            yield from _mappings_below(item)


def _quoted_like(node: ScalarNode, new: str) -> str:
    return f"{node.style}{new}{node.style}" if node.style in _QUOTES else new


def _edited(text: str, edits: Sequence[tuple[SourceSpan, str]]) -> str:
    for span, new in sorted(edits, key=lambda edit: edit[0].start, reverse=True):
        text = text[: span.start] + new + text[span.end :]
    return text
