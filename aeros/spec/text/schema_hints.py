"""What a schema's type hints say: its fields, and the forms that each may be written in."""

from __future__ import annotations

import dataclasses
import keyword
import types
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, Final, Literal, Union, get_args, get_origin, get_type_hints

from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.text.fields import (
    PATTERNS,
    BooleanField,
    ChoiceField,
    ExpressionField,
    IntegerField,
    MappingField,
    NumberField,
    Pattern,
    TextField,
)
from aeros.spec.text.nodes import MappingNode, ScalarNode, SequenceNode

_LOCATED_TYPES: Final[tuple[type, ...]] = (
    TextField,
    ExpressionField,
    BooleanField,
    IntegerField,
    NumberField,
)
_LOCATION_FIELDS: Final = ("span", "key_span")


@dataclass(frozen=True, slots=True)
class SchemaField:
    """One declared field under the name it has in YAML."""

    attribute: str
    hint: Any
    is_required: bool
    doc: str
    example: str


@cache
def fields_of(schema: type) -> dict[str, SchemaField]:
    """The fields of a schema by YAML name, checked to be decodable."""
    hints = get_type_hints(schema, include_extras=True)
    if hints.get("span") is not SourceSpan:
        raise MisuseError(f"{schema.__name__} must declare `span: Span`")
    fields = {}
    for declared in dataclasses.fields(schema):
        if declared.name in _LOCATION_FIELDS:
            continue
        hint = hints[declared.name]
        kinds = [node_kind(split_annotated(option)[0]) for option in admitted_forms(hint)]
        if len(set(kinds)) != len(kinds):
            raise MisuseError(
                f"{schema.__name__}.{declared.name}: YAML cannot tell the options of {hint} apart"
            )
        is_required = (
            declared.default is dataclasses.MISSING and declared.default_factory is dataclasses.MISSING
        )
        doc, example = (
            declared.metadata.get("doc", ""),
            declared.metadata.get("example") or example_text(hint),
        )
        fields[_yaml_name(declared.name)] = SchemaField(declared.name, hint, is_required, doc, example)
    return fields


def _yaml_name(attribute: str) -> str:
    """`from_` is written `from`; every other attribute is written as it is."""
    bare = attribute.removesuffix("_")
    return bare if keyword.iskeyword(bare) or bare in ("all", "any") else attribute


def admitted_forms(hint: Any) -> tuple[Any, ...]:
    """The forms a hint admits; None only says that the field has a default."""
    if get_origin(hint) in (Union, types.UnionType):
        return tuple(option for option in get_args(hint) if option is not type(None))
    return (hint,)


def split_annotated(hint: Any) -> tuple[Any, tuple[Any, ...]]:
    """A hint without its `Annotated` marks, and the marks."""
    if get_origin(hint) is Annotated:
        base, *marks = get_args(hint)
        return base, tuple(marks)
    return hint, ()


def node_kind(base: Any) -> type[ScalarNode] | type[SequenceNode] | type[MappingNode]:
    """The kind of node a form is written as."""
    origin = get_origin(base)
    if base in _LOCATED_TYPES or origin in (Literal, ChoiceField):
        return ScalarNode
    if origin is tuple and len(get_args(base)) == 2 and get_args(base)[1] is ...:
        return SequenceNode
    if origin is MappingField or dataclasses.is_dataclass(base):
        return MappingNode
    raise MisuseError(f"{base!r} cannot be decoded")


def allowed_words(base: Any) -> tuple[str, ...] | None:
    """The only words a form admits; None where it admits others."""
    if get_origin(base) is ChoiceField:
        base = get_args(base)[0]
    return get_args(base) if get_origin(base) is Literal else None


def example_text(hint: Any) -> str:
    """How a field of this hint could be written."""
    base, marks = split_annotated(admitted_forms(hint)[0])
    words = allowed_words(base)
    if words is not None:
        return words[0]
    for mark in marks:
        if isinstance(mark, Pattern) and base is TextField:
            return PATTERNS[mark.name].example
    written = {
        TextField: "…",
        ExpressionField: "…",
        BooleanField: "true",
        IntegerField: "1",
        NumberField: "0.25",
    }
    kinds = {SequenceNode: "[…]", MappingNode: "{…}"}
    return written.get(base) or kinds[node_kind(base)]
