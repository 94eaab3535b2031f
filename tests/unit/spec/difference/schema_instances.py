"""Instances of the schema of a file: one with every field, and copies of it that differ in one field."""

from __future__ import annotations

import types
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from fractions import Fraction
from functools import cache
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from aeros.spec.diagnostics.source import Source, SourceSpan
from aeros.spec.text.fields import (
    BooleanField,
    ChoiceField,
    ExpressionField,
    IntegerField,
    MappingField,
    NumberField,
    TextField,
)
from aeros.spec.text.nodes import ScalarNode

SPAN = Source("file.yaml", "text of a field").span(0, 4)
NODE = ScalarNode("text", SPAN, "")
VALUES: dict[Any, tuple[Any, Any]] = {
    TextField: ("a", "b"),
    ExpressionField: ("a", "b"),
    BooleanField: (True, False),
    IntegerField: (1, 2),
    NumberField: (Fraction(1), Fraction(2)),
    ChoiceField: ("a", "b"),
}
_PLACES = ("span", "key_span")
_DEPTH = 2  # times that a thing may hold another of its kind
hints = cache(lambda schema: get_type_hints(schema, include_extras=True))


def schema_paths(schema: Any) -> list[str]:
    """Every place of a value in a file of this schema; `*` stands for a key or an entry."""
    return [".".join(path) for path, _ in _places(schema, (), ())]


def instance(schema: Any, changed: str = "", removed: str = "") -> Any:
    """A file with all fields, of which one place may have another value, or hold no value."""
    return _built(schema, (), (), changed, removed)


def _bare(hint: Any) -> Any:
    """The hint without annotations and None."""
    while get_origin(hint) is Annotated:
        hint = get_args(hint)[0]
    if get_origin(hint) in (Union, types.UnionType):
        (hint, *_) = [one for one in get_args(hint) if one is not type(None)]
        return _bare(hint)
    return hint


def _is_thing(hint: Any) -> bool:
    """True for a part of a file that has fields of its own."""
    bare = _bare(hint)
    return is_dataclass(bare) and (get_origin(bare) or bare) not in VALUES


def _places(
    hint: Any, path: tuple[str, ...], above: tuple[Any, ...]
) -> Iterator[tuple[tuple[str, ...], Any]]:
    bare = _bare(hint)
    origin = get_origin(bare) or bare
    if origin is MappingField or origin is tuple:
        inner = get_args(bare)[0]
        plain = origin is tuple and not _is_thing(inner)
        yield from [(path, bare)] if plain else _places(inner, (*path, "*"), above)
    elif origin in VALUES or origin is Literal:
        if origin is not Literal:
            yield path, bare
    elif above.count(bare) < _DEPTH:
        for field in fields(bare):
            if field.name not in _PLACES:
                name = field.name.removesuffix("_")
                yield from _places(hints(bare)[field.name], (*path, name), (*above, bare))


def _built(hint: Any, path: tuple[str, ...], above: tuple[Any, ...], changed: str, removed: str) -> Any:
    here = ".".join(path)
    bare = _bare(hint)
    origin = get_origin(bare) or bare
    if here == removed and removed:
        return MappingField() if origin is MappingField else () if origin is tuple else None
    if origin is MappingField:
        value = _built(get_args(bare)[0], (*path, "*"), above, changed, removed)
        return MappingField(() if value is None else ((_field(TextField, "key"), value),), SPAN)
    if origin is tuple:
        inner = get_args(bare)[0]
        if not _is_thing(inner):
            return (_built(inner, path, above, changed, removed),)
        value = _built(inner, (*path, "*"), above, changed, removed)
        return () if value is None else (value,)
    if origin is Literal:
        return get_args(bare)[0]
    if origin in VALUES:
        return _field(origin, VALUES[origin][here == changed])
    if above.count(bare) >= _DEPTH:
        return None
    named = {
        field.name: SPAN
        if field.name in _PLACES
        else _built(
            hints(bare)[field.name],
            (*path, field.name.removesuffix("_")),
            (*above, bare),
            changed,
            removed,
        )
        for field in fields(bare)
    }
    return bare(**named)


def _field(kind: Any, value: Any) -> Any:
    return kind(value, SPAN, NODE)


def place(start: int, end: int) -> SourceSpan:
    """A place in the file of the instances."""
    return SPAN.source.span(start, end)
