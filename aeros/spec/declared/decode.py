"""Decoder from YAML nodes to frozen dataclasses by their type hints; it refuses everything undeclared.

A schema is a dataclass. Its fields are `TextField`, `ExpressionField`, `BooleanField`, `IntegerField`,
`NumberField`, `ChoiceField[Literal[...]]` or a bare `Literal`, `tuple[T, ...]`, `MappingField[T]`, another
dataclass, or a union of forms that YAML itself distinguishes (one single value, one list, one mapping). A
field with a default may be left out. `field(metadata={"doc": ..., "example": ...})` explains a field in the
diagnostic for its absence. Two fields are filled here and never read: `span`, which every schema declares,
and `key_span`, the key above the mapping, which a schema may declare.

Every problem is reported, and nothing is built from a node with a problem: a result is None or complete.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from typing import Any, Final, Literal, NamedTuple, TypeVar, get_args, get_origin

from aeros.spec.diagnostics.codes import Diagnostics, did_you_mean, quoted
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.expr.doubles import double_problem
from aeros.spec.migrations.format import parse_schema
from aeros.spec.migrations.formats import format_named
from aeros.spec.text.fields import (
    MAX_NAME,
    PATTERNS,
    BooleanField,
    ChoiceField,
    ExpressionField,
    IntegerField,
    LengthBounds,
    MappingField,
    NumberField,
    Pattern,
    TextField,
    ValueBounds,
)
from aeros.spec.text.nodes import MappingNode, Node, ScalarNode, SequenceNode
from aeros.spec.text.schema_hints import (
    SchemaField,
    admitted_forms,
    allowed_words,
    fields_of,
    node_kind,
    split_annotated,
)

T = TypeVar("T")


_INTEGER: Final = re.compile(r"-?(0|[1-9][0-9]*)")
_NUMBER: Final = re.compile(r"-?(0|[1-9][0-9]*)(\.[0-9]+)?([eE][+-]?[0-9]{1,3})?")
_LONGEST_LITERAL: Final = 64  # no quantity needs more digits, and exact arithmetic pays for each

_SCALARS: Final[dict[type, str]] = {
    TextField: "text",
    ExpressionField: "an expression",
    BooleanField: "`true` or `false`",
    IntegerField: "an integer",
    NumberField: "a number",
}


def decode(node: Node, schema: type[T], diagnostics: Diagnostics) -> T | None:
    """Decode a node as an instance of a schema.

    Args:
        node: root of a document, or any mapping.
        schema: dataclass to decode to.
        diagnostics: receives the errors.

    Returns:
        The instance; None if there were errors.

    Raises:
        MisuseError: `schema` is not a dataclass.
    """
    if not dataclasses.is_dataclass(schema):
        raise MisuseError(f"{schema!r} is not a dataclass")
    if _is_of_another_version(node, schema, diagnostics):
        return None  # fields of another version mean nothing here
    decoded: T | None = _Decoder(diagnostics).value(node, schema, _FieldLocation("", None))
    return decoded


def _is_of_another_version(node: Node, schema: type, diagnostics: Diagnostics) -> bool:
    """Say if the file is of another version of the format that is asked for; report it if so."""
    known = fields_of(schema).get("schema")
    words = None if known is None else allowed_words(split_annotated(admitted_forms(known.hint)[0])[0])
    expected = parse_schema(words[0]) if words else None
    entries = node.entries if isinstance(node, MappingNode) else ()
    written = next((value for key, value in entries if key.text == "schema"), None)
    if expected is None or not isinstance(written, ScalarNode):
        return False
    format_ = format_named(expected[0])
    version = format_.version_from_schema(written.text)
    if version is None or version < format_.first or version == format_.version:
        return False
    cause, cure = format_.refusal(version, written.span.source.path)
    diagnostics.error(
        "AE114", cause, written.span, help=(cure, "docs/formats.md says what changed in each version")
    )
    return True


@dataclass(frozen=True, slots=True)
class _FieldLocation:
    """Field that a value belongs to: its name, "" at the top, and the key that holds it."""

    name: str
    key_span: SourceSpan | None

    @property
    def prefix(self) -> str:
        return f"{quoted(self.name)}: " if self.name else ""


class _Form(NamedTuple):
    """A form that a hint admits: without its marks, these, and the generic type that it is made of."""

    base: Any
    marks: tuple[Any, ...]
    origin: Any


@cache  # there are a few hundred hints
def _forms_by_kind(hint: Any) -> Mapping[type[Node], _Form]:
    """Return the form that each kind of node is decoded to; the first, if there are several."""
    found: dict[type[Node], _Form] = {}
    for option in admitted_forms(hint):
        base, marks = split_annotated(option)
        found.setdefault(node_kind(base), _Form(base, marks, get_origin(base)))
    return found


class _Decoder:
    """Decoder by hints. None stands for "reported", as no hint admits the value None."""

    def __init__(self, diagnostics: Diagnostics) -> None:
        self._diagnostics = diagnostics

    def value(self, node: Node, hint: Any, location: _FieldLocation) -> Any:
        form = _forms_by_kind(hint).get(type(node))
        if form is None:
            self._wrong_kind(node, hint, location)
            return None
        if isinstance(node, ScalarNode):
            return self._scalar(node, form, location)
        if isinstance(node, SequenceNode):
            return self._list(node, form.base, form.marks, location)
        if form.origin is MappingField:
            return self._mapping(node, form.base, form.marks, location)
        return self._record(node, form.base, location)

    def _wrong_kind(self, node: Node, hint: Any, location: _FieldLocation) -> None:
        if isinstance(node, ScalarNode) and node.is_null:
            self._missing_value(node, hint, location)
            return
        headline = f"{location.prefix}expected {_describe_hint(hint)}, found {_describe_node(node)}"
        self._diagnostics.error("AE103", headline, _first_line_span(node), f"this is {_describe_node(node)}")

    def _missing_value(self, node: ScalarNode, hint: Any, location: _FieldLocation) -> None:
        at = node.span if node.text or location.key_span is None else location.key_span
        help_ = ("write the value, or leave the field out if it has a default",)
        self._diagnostics.error(
            "AE104", f"{location.prefix}expected {_describe_hint(hint)}, found nothing", at, help=help_
        )

    def _scalar(self, node: ScalarNode, form: _Form, location: _FieldLocation) -> Any:
        base, marks, origin = form
        if node.is_null:
            self._missing_value(node, base, location)
            return None
        if origin is Literal:
            return self._word(node, base, location)
        if origin is ChoiceField:
            word = self._word(node, get_args(base)[0], location)
            return None if word is None else ChoiceField(word, node.span, node)
        if base in (TextField, ExpressionField):
            return base(node.text, node.span, node) if self._matches(node, marks, location) else None
        if not self._is_bare(node, base, location):
            return None
        if base is BooleanField:
            return self._boolean(node, location)
        return self._quantity(node, base, marks, location)

    def _matches(self, node: ScalarNode, marks: tuple[Any, ...], location: _FieldLocation) -> bool:
        for mark in marks:
            if isinstance(mark, Pattern) and not PATTERNS[mark.name].regex.fullmatch(node.text):
                form = PATTERNS[mark.name]
                headline = f"{location.prefix}{quoted(node.text)} is not a well-formed {mark.name}"
                help_ = (f"write {form.words}, as in `{form.example}`",)
                self._diagnostics.error("AE105", headline, node.span, help=help_)
                return False
            if isinstance(mark, Pattern) and len(node.text) > MAX_NAME:
                headline = f"{location.prefix}{quoted(node.text)} has {len(node.text):,} characters"
                help_ = (f"write at most {MAX_NAME} characters",)
                self._diagnostics.error("AE105", headline, node.span, help=help_)
                return False
        return True

    def _word(self, node: ScalarNode, literal: Any, location: _FieldLocation) -> str | None:
        words: tuple[str, ...] = get_args(literal)
        if node.text in words:
            return node.text
        headline = f"{location.prefix}{quoted(node.text)} is not one of the allowed words"
        self._diagnostics.error(
            "AE110",
            headline,
            node.span,
            help=_suggestion(node.text, words, f"write one of {_join_names(words)}"),
        )
        return None

    def _is_bare(self, node: ScalarNode, base: type, location: _FieldLocation) -> bool:
        if node.is_plain:
            return True
        headline = f"{location.prefix}expected {_SCALARS[base]}, found quoted text"
        help_ = "remove the quotes" if node.style in ("'", '"') else "write the value on the line of its key"
        self._diagnostics.error("AE109", headline, node.span, help=(help_,))
        return False

    def _boolean(self, node: ScalarNode, location: _FieldLocation) -> BooleanField | None:
        if node.text in ("true", "false"):
            return BooleanField(node.text == "true", node.span, node)
        headline = f"{location.prefix}expected `true` or `false`, found {quoted(node.text)}"
        self._diagnostics.error(
            "AE106", headline, node.span, help=("write `true` or `false`, in lower case",)
        )
        return None

    def _quantity(
        self, node: ScalarNode, base: type, marks: tuple[Any, ...], location: _FieldLocation
    ) -> Any:
        """Decode an `IntegerField` or `NumberField` within its bounds."""
        code, regex, example = (
            ("AE107", _INTEGER, "20") if base is IntegerField else ("AE108", _NUMBER, "0.25` or `1e-3")
        )
        if len(node.text) > _LONGEST_LITERAL or not regex.fullmatch(node.text):
            headline = f"{location.prefix}expected {_SCALARS[base]}, found {quoted(node.text)}"
            self._diagnostics.error(
                code, headline, node.span, help=(f"write decimal digits, as in `{example}`",)
            )
            return None
        value = int(node.text) if base is IntegerField else Fraction(node.text)
        lost = double_problem(Fraction(value))
        if lost is not None:
            headline = f"{location.prefix}{quoted(node.text)} {lost}"
            self._diagnostics.error(code, headline, node.span, help=("write 0 or another number",))
            return None
        for mark in marks:
            if isinstance(mark, ValueBounds) and not _is_within(value, mark):
                headline = f"{location.prefix}{quoted(node.text)} is outside its bounds"
                self._diagnostics.error("AE111", headline, node.span, help=(f"write a value {_range(mark)}",))
                return None
        return base(value, node.span, node)

    def _list(self, node: SequenceNode, base: Any, marks: tuple[Any, ...], location: _FieldLocation) -> Any:
        (item_hint, _) = get_args(base)
        items = []
        for item in node.items:
            if self._diagnostics.is_full:
                return None
            items.append(self.value(item, item_hint, _FieldLocation(location.name, None)))
        if not self._check_length(node, len(items), marks, location) or None in items:
            return None
        return tuple(items)

    def _mapping(self, node: MappingNode, base: Any, marks: tuple[Any, ...], location: _FieldLocation) -> Any:
        (item_hint,) = get_args(base)
        items = []
        is_whole = self._check_length(node, len(node.entries), marks, location)
        for key, item in node.entries:
            if self._diagnostics.is_full:
                return None
            is_named = self._matches(key, marks, location)
            value = self.value(item, item_hint, _FieldLocation(key.text, key.span))
            is_whole = is_whole and is_named and value is not None
            items.append((TextField(key.text, key.span, key), value))
        return MappingField(tuple(items), node.span) if is_whole else None

    def _check_length(self, node: Node, count: int, marks: tuple[Any, ...], location: _FieldLocation) -> bool:
        for mark in marks:
            if isinstance(mark, LengthBounds) and not _is_within(count, ValueBounds(mark.lo, mark.hi)):
                headline = f"{location.prefix}{count} entries are not allowed here"
                help_ = (f"write a number of entries {_range(ValueBounds(mark.lo, mark.hi))}",)
                self._diagnostics.error(
                    "AE112", headline, location.key_span or _first_line_span(node), help=help_
                )
                return False
        return True

    def _record(self, node: MappingNode, schema: type, location: _FieldLocation) -> Any:
        fields = fields_of(schema)
        values: dict[str, Any] = {}
        for key, item in node.entries:
            if self._diagnostics.is_full:
                return None
            if key.text in fields:
                known = fields[key.text]
                values[known.attribute] = self.value(item, known.hint, _FieldLocation(key.text, key.span))
            else:
                self._unknown(key, fields, location)
                values[""] = None
        self._report_missing(node, fields, values, location)
        if None in values.values() or any(
            f.is_required and f.attribute not in values for f in fields.values()
        ):
            return None
        filled = {"span": node.span, "key_span": location.key_span}
        declared = {declared.name for declared in dataclasses.fields(schema)}
        return schema(**values, **{name: span for name, span in filled.items() if name in declared})

    def _unknown(self, key: ScalarNode, fields: dict[str, SchemaField], location: _FieldLocation) -> None:
        within = f" in {quoted(location.name)}" if location.name else ""
        self._diagnostics.error(
            "AE101",
            f"unknown field {quoted(key.text)}{within}",
            key.span,
            help=_suggestion(key.text, fields, f"the fields are {_join_names(fields)}"),
        )

    def _report_missing(
        self,
        node: MappingNode,
        fields: dict[str, SchemaField],
        values: dict[str, Any],
        location: _FieldLocation,
    ) -> None:
        first_key = node.entries[0][0].span if node.entries else _first_line_span(node)
        within = f" in {quoted(location.name)}" if location.name else ""
        for name, field in fields.items():
            if field.is_required and field.attribute not in values:
                doc = f" ({field.doc})" if field.doc else ""
                self._diagnostics.error(
                    "AE102",
                    f"the field `{name}` is missing{within}",
                    location.key_span or first_key,
                    help=(f"add `{name}: {field.example}`{doc}",),
                )


def _describe_hint(hint: Any) -> str:
    return " or ".join(_describe_form(split_annotated(option)[0]) for option in admitted_forms(hint))


def _describe_form(base: Any) -> str:
    words = allowed_words(base)
    if words is not None:
        return f"one of {_join_names(words)}"
    kinds = {SequenceNode: "a list", MappingNode: "a mapping"}
    return _SCALARS.get(base) or kinds[node_kind(base)]


def _describe_node(node: Node) -> str:
    if isinstance(node, MappingNode):
        return "a mapping"
    return "a list" if isinstance(node, SequenceNode) else "a single value"


def _first_line_span(node: Node) -> SourceSpan:
    """Return the span to underline for a whole node: its first line."""
    span = node.span
    line_end = span.source.text.find("\n", span.start, span.end)
    return span if line_end < 0 else SourceSpan(span.source, span.start, line_end)


def _join_names(names: Any) -> str:
    return ", ".join(f"`{name}`" for name in names)


def _suggestion(name: str, candidates: Any, otherwise: str) -> tuple[str, ...]:
    near = did_you_mean(name, candidates)
    return (otherwise,) if near is None else (f"did you mean `{near}`?", otherwise)


def _is_within(value: int | Fraction, bounds: ValueBounds) -> bool:
    return (bounds.lo is None or bounds.lo <= value) and (bounds.hi is None or value <= bounds.hi)


def _range(bounds: ValueBounds) -> str:
    if bounds.lo is None:
        return f"of at most {bounds.hi}"
    return f"of at least {bounds.lo}" if bounds.hi is None else f"from {bounds.lo} to {bounds.hi}"
