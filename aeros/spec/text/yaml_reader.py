"""Reader from YAML to nodes with their places. It refuses everything in YAML beyond plain data.

Refused: duplicate keys, aliases and anchors, tags, merge keys, directives, several documents, keys that are
not text, characters that are invisible or reorder the text shown. Types are not guessed here: `no`,
`12:30:00` and `1.10` stay the text that was written.

The nodes are built from parser events without recursion, and building stops at `MAX_DEPTH` and `MAX_NODES`,
because libyaml's time is quadratic in depth and its composer overflows the stack. libyaml counts some
characters as line breaks which `Source` does not, so places are taken from its character index alone.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any, Final

import yaml

from aeros.spec.diagnostics.characters import find_hidden
from aeros.spec.diagnostics.codes import Diagnostics, SpanLabel, quoted
from aeros.spec.diagnostics.source import Source, SourceSpan
from aeros.spec.text.files import MAX_BYTES, hidden_character_error, too_large_error
from aeros.spec.text.nodes import MappingNode, Node, ScalarNode, SequenceNode

MAX_DEPTH: Final = 32
MAX_NODES: Final = 100_000

_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # PyYAML may be built without libyaml

_TAG: Final = re.compile(r"[^\s,\[\]{}]*")


def read_yaml(source: Source, diagnostics: Diagnostics) -> Node | None:
    """Read the one document of a YAML file.

    Args:
        source: text of the file.
        diagnostics: receives the errors.

    Returns:
        The root node; None if anything was refused.
    """
    if len(source.text) > MAX_BYTES:
        diagnostics.report(too_large_error(source.path))
        return None
    offset = find_hidden(source.text)
    if offset is not None:
        diagnostics.report(hidden_character_error(source.span(offset, offset + 1)))
        return None
    return _NodeBuilder(source, diagnostics).build()


class _ReadAborted(Exception):  # noqa: N818  control flow, not an error: it was reported already
    """Signal that reading on is pointless or dangerous."""


@dataclass(slots=True)
class _OpenCollection:
    """Collection whose end has not been reached."""

    is_mapping: bool
    is_flow: bool
    start: int
    items: list[Node] = field(default_factory=list)
    entries: list[tuple[ScalarNode, Node]] = field(default_factory=list)
    keys: dict[str, ScalarNode] = field(default_factory=dict)
    key: Node | None = None


class _NodeBuilder:
    """Builder of nodes from parser events. It reports everything that is refused."""

    def __init__(self, source: Source, diagnostics: Diagnostics) -> None:
        self._source = source
        self._diagnostics = diagnostics
        self._open: list[_OpenCollection] = []
        self._root: Node | None = None
        self._nodes = 0
        self._refused = False

    def build(self) -> Node | None:
        try:
            for event in yaml.parse(self._source.text, Loader=_LOADER):
                self._handle_event(event)
        except _ReadAborted:
            return None
        except yaml.MarkedYAMLError as problem:
            self._syntax(problem)
            return None
        except yaml.YAMLError as problem:
            self._refuse("AE007", f"not well-formed YAML: {_one_line(str(problem))}", None)
            return None
        if self._root is None and not self._refused:
            self._refuse("AE006", "the file declares nothing", self._span(0, 0))
        return None if self._refused else self._root

    def _span(self, start: int, end: int) -> SourceSpan:
        return self._source.span(start, end)

    def _refuse(
        self,
        code: str,
        headline: str,
        at: SourceSpan | None,
        label: str = "",
        *,
        advice: str = "",
        other: SpanLabel | None = None,
    ) -> None:
        self._refused = True
        secondary = () if other is None else (other,)
        self._diagnostics.error(
            code, headline, at, label, secondary=secondary, help=(advice,) if advice else ()
        )

    def _handle_event(self, event: Any) -> None:
        start, end = event.start_mark.index, event.end_mark.index
        if isinstance(event, yaml.DocumentStartEvent):
            self._document(event, self._span(start, end))
        elif isinstance(event, yaml.AliasEvent):
            span = self._span(start, end)
            self._refuse(
                "AE011",
                f"{quoted(span.text)} refers to a value written elsewhere",
                span,
                advice="write the value out",
            )
            self._add(ScalarNode("", span, "'"))
        elif isinstance(event, yaml.ScalarEvent):
            self._properties(event)
            self._add(self._scalar(event.value, start, end, event.style or ""))
        elif isinstance(event, yaml.MappingStartEvent | yaml.SequenceStartEvent):
            self._properties(event)
            self._open_collection(event, start, end)
        elif isinstance(event, yaml.MappingEndEvent | yaml.SequenceEndEvent):
            self._add(self._close_collection(self._open.pop(), end))

    def _document(self, event: yaml.DocumentStartEvent, span: SourceSpan) -> None:
        if self._root is not None:
            self._refuse(
                "AE013", "a second document begins here", span, advice="put it into a file of its own"
            )
            raise _ReadAborted
        if event.version or event.tags:
            self._refuse(
                "AE016",
                "directives are not part of a manifest",
                span,
                advice="delete the lines that begin with `%`",
            )

    def _properties(self, event: Any) -> None:
        """Refuse anchors and tags, which stand before a value."""
        start = event.start_mark.index
        if event.anchor is not None:
            sign = self._source.text.find("&" + event.anchor, start)
            span = self._span(sign, sign + 1 + len(event.anchor))
            self._refuse(
                "AE011",
                f"{quoted(span.text)} names a value for later reference",
                span,
                advice="write the value out at each place that uses it",
            )
        # A lone `!` leaves no tag, only the trace that the value was not left to the schema.
        is_bare = isinstance(event, yaml.ScalarEvent) and not any(event.implicit)
        if event.tag is not None or is_bare:
            sign = self._source.text.find("!", start)
            written = _TAG.match(self._source.text, sign)
            span = self._span(sign, written.end() if written else sign)
            self._refuse(
                "AE012",
                f"the tag {quoted(span.text)} is not allowed",
                span,
                advice="delete it: the schema decides types",
            )

    def _scalar(self, text: str, start: int, end: int, style: str) -> ScalarNode:
        if style in ("|", ">"):  # a block's mark lies after the empty lines and indentation that follow it
            end = start + len(self._source.text[start:end].rstrip())
        span = self._span(start, end)
        offset = find_hidden(text)
        if offset is not None:  # written as an escape, as the source itself was searched before
            self._refused = True
            self._diagnostics.report(hidden_character_error(span, text[offset]))
        return ScalarNode(text, span, style)

    def _open_collection(self, event: Any, start: int, end: int) -> None:
        if len(self._open) >= MAX_DEPTH:
            self._refuse("AE010", f"values are nested more than {MAX_DEPTH} deep", self._span(start, end))
            raise _ReadAborted
        is_mapping = isinstance(event, yaml.MappingStartEvent)
        self._open.append(_OpenCollection(is_mapping, bool(event.flow_style), start))

    def _close_collection(self, opened: _OpenCollection, mark: int) -> Node:
        """Finish a collection; in block style it ends with its last value, not at the next token."""
        end = mark
        if not opened.is_flow:
            last = opened.entries[-1][1] if opened.entries else opened.items[-1] if opened.items else None
            end = opened.start if last is None else max(opened.start, last.span.end)
        span = self._span(opened.start, end)
        if opened.is_mapping:
            return MappingNode(tuple(opened.entries), span)
        return SequenceNode(tuple(opened.items), span)

    def _add(self, node: Node) -> None:
        self._nodes += 1
        if self._nodes > MAX_NODES:
            self._refuse(
                "AE017",
                f"the file holds more than {MAX_NODES:,} values",
                self._span(node.span.start, node.span.start),
            )
        if self._nodes > MAX_NODES or self._diagnostics.is_full:
            raise _ReadAborted
        if not self._open:
            self._root = node
            return
        into = self._open[-1]
        if not into.is_mapping:
            into.items.append(node)
        elif into.key is None:
            into.key = node
            self._check_key(into, node)
        else:
            if isinstance(into.key, ScalarNode):
                into.entries.append((into.key, node))
            into.key = None

    def _check_key(self, into: _OpenCollection, key: Node) -> None:
        if not isinstance(key, ScalarNode) or key.is_null:
            self._refuse("AE014", "a key must be text", key.span, advice="write a name before the `:`")
        elif key.is_plain and key.text == "<<":
            self._refuse("AE015", "mappings cannot be merged", key.span, advice="write the entries out")
        elif key.text in into.keys:
            first = SpanLabel(into.keys[key.text].span, "first written here")
            self._refuse(
                "AE001", f"the key {quoted(key.text)} is written twice", key.span, "again here", other=first
            )
        else:
            into.keys[key.text] = key

    def _syntax(self, problem: yaml.MarkedYAMLError) -> None:
        """Report the parser's complaint at its place, in its own words unless ours are clearer."""
        text = self._source.text
        complaint, context = _one_line(problem.problem or ""), _one_line(problem.context or "")
        at = self._mark(problem.problem_mark)
        if text[at : at + 1] == "\t":
            span = self._span(at, at + 1)
            self._refuse("AE008", "a tab cannot indent", span, advice="indent with spaces")
            return
        context_start = self._mark(problem.context_mark) if problem.context_mark else at
        if "quoted scalar" in context and ("end of stream" in complaint or "document indicator" in complaint):
            opening = self._span(context_start, min(context_start + 1, len(text)))
            self._refuse("AE009", "a quoted text is never closed", opening, "opened here")
            return
        end = at + 1 if text[at : at + 1].strip() else at
        has_context = bool(context) and context_start != at
        other = SpanLabel(self._span(context_start, context_start), context) if has_context else None
        self._refuse(
            "AE007",
            f"not well-formed YAML: {complaint}",
            self._span(at, end),
            advice=_advice(complaint),
            other=other,
        )

    def _mark(self, mark: Any) -> int:
        """Return the mark's offset, inside the text: an end may be marked behind it."""
        return min(mark.index, len(self._source.text)) if mark else 0


def _one_line(text: str) -> str:
    return " ".join(text.split())


def _advice(problem: str) -> str:
    if "mapping values are not allowed" in problem:
        return "quote a text that holds `: `, or indent a nested field"
    if "cannot start any token" in problem:
        return "quote a text that begins with this character"
    if "expected ',' or" in problem:
        return "close the bracket, or quote a text that holds brackets, braces or commas"
    return ""
