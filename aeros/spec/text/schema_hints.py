"""Type hints of a schema: its fields, and the forms that each may be written in."""

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
    """Field of a declared dataclass; `fields_of` gives it by its name in YAML.

    Attributes:
        attribute: name in the dataclass.
        hint: type annotation, with its `Annotated` marks.
        is_required: True if a file must have it.
        doc: explanation for editors; may be empty.
        example: example for editors; may be empty.
    """

    attribute: str
    hint: Any
    is_required: bool
    doc: str
    example: str


@cache
def fields_of(schema: type) -> dict[str, SchemaField]:
    """List the fields of a schema and check that they can be decoded.

    Args:
        schema: dataclass with a field `span`.

    Returns:
        The fields by YAML name; cached.

    Raises:
        MisuseError: the schema has no `span`, or YAML cannot distinguish the forms of a field.
    """
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
    """Return the YAML name of an attribute: `from_` is written `from`, others as they are."""
    bare = attribute.removesuffix("_")
    return bare if keyword.iskeyword(bare) or bare in ("all", "any") else attribute


def admitted_forms(hint: Any) -> tuple[Any, ...]:
    """List the forms that a hint admits.

    Args:
        hint: type hint, perhaps a union. None in it only means that the field has a default.

    Returns:
        The alternatives of the union without None, or the hint alone.
    """
    if get_origin(hint) in (Union, types.UnionType):
        return tuple(option for option in get_args(hint) if option is not type(None))
    return (hint,)


def split_annotated(hint: Any) -> tuple[Any, tuple[Any, ...]]:
    """Split a hint from its `Annotated` marks.

    Args:
        hint: type hint.

    Returns:
        The bare hint, and its marks.
    """
    if get_origin(hint) is Annotated:
        base, *marks = get_args(hint)
        return base, tuple(marks)
    return hint, ()


def node_kind(base: Any) -> type[ScalarNode] | type[SequenceNode] | type[MappingNode]:
    """Return the kind of node that a form is written as.

    Args:
        base: bare hint, without marks.

    Returns:
        The class of the node.

    Raises:
        MisuseError: no node can be decoded to it.
    """
    origin = get_origin(base)
    if base in _LOCATED_TYPES or origin in (Literal, ChoiceField):
        return ScalarNode
    if origin is tuple and len(get_args(base)) == 2 and get_args(base)[1] is ...:
        return SequenceNode
    if origin is MappingField or dataclasses.is_dataclass(base):
        return MappingNode
    raise MisuseError(f"{base!r} cannot be decoded")


def allowed_words(base: Any) -> tuple[str, ...] | None:
    """List the only words that a form admits.

    Args:
        base: bare hint.

    Returns:
        The words; None if the form admits others.
    """
    if get_origin(base) is ChoiceField:
        base = get_args(base)[0]
    return get_args(base) if get_origin(base) is Literal else None


def example_text(hint: Any) -> str:
    """Give an example of a field's value.

    Args:
        hint: type hint of the field.

    Returns:
        Text as it could be written in YAML.
    """
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
