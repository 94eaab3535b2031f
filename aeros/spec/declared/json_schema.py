"""JSON Schema 2020-12 of declared files, so that editors complete and check them.

Every file that `decode` accepts is valid. Unknown and missing fields, wrong kinds of value, malformed names,
unknown words and numbers out of bounds are invalid. Only `aeros verify` reports errors that the parsed values
do not show: quotes around a number, `1e0` for an integer, a key that is written twice.
"""

from __future__ import annotations

import inspect
from typing import Any, Final, get_args, get_origin

from aeros.spec.declared import ecm, faults, people, scene, site
from aeros.spec.declared.robots import robot
from aeros.spec.declared.testing import site_tests
from aeros.spec.migrations.formats import format_named
from aeros.spec.text.fields import (
    PATTERNS,
    BooleanField,
    IntegerField,
    LengthBounds,
    MappingField,
    NumberField,
    Pattern,
    ValueBounds,
)
from aeros.spec.text.nodes import ScalarNode, SequenceNode
from aeros.spec.text.schema_hints import admitted_forms, allowed_words, fields_of, node_kind, split_annotated

FILES: Final[dict[str, type]] = {
    "ecm": ecm.Ecm,
    "site": site.Site,
    "overlay": site.Overlay,
    "people": people.People,
    "faults": faults.Faults,
    "robot": robot.Robot,
    "scene": scene.Scene,
    "tests": site_tests.SiteTests,
}
"""The declared files, by the name of their schema."""

_TITLES: Final = {
    "ecm": "AEROS module manifest, ecm.yaml",
    "site": "AEROS site file",
    "overlay": "AEROS overlay on a site file",
    "people": "AEROS people file",
    "faults": "AEROS faults file",
    "robot": "AEROS robot file",
    "scene": "AEROS scene file",
    "tests": "AEROS tests of a site",
}


def json_schema_of(name: str) -> dict[str, Any]:
    """Build the JSON Schema of a declared file.

    Args:
        name: name of the file's schema, one of `FILES`.

    Returns:
        Data for `json.dumps`.
    """
    root = FILES[name]
    definitions: dict[str, Any] = {}
    record = _record(root, definitions)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": f"urn:aeros:{name}:{format_named(name).version}",
        "title": _TITLES[name],
        **record,
        "$defs": dict(sorted(definitions.items())),
    }


def _record(schema: type, definitions: dict[str, Any]) -> dict[str, Any]:
    """A closed mapping of declared fields; the records it refers to are added to `definitions`."""
    fields = fields_of(schema)
    return {
        "description": (inspect.getdoc(schema) or "").partition("\n")[0],
        "type": "object",
        "properties": {
            name: {"description": field.doc, **_hint(field.hint, definitions)}
            for name, field in fields.items()
        },
        "required": [name for name, field in fields.items() if field.is_required],
        "additionalProperties": False,
    }


def _hint(hint: Any, definitions: dict[str, Any]) -> dict[str, Any]:
    forms = [_form(*split_annotated(option), definitions) for option in admitted_forms(hint)]
    return forms[0] if len(forms) == 1 else {"anyOf": forms}


def _form(base: Any, marks: tuple[Any, ...], definitions: dict[str, Any]) -> dict[str, Any]:
    """A scalar, a list, a mapping whose keys the user names, or a record, which is referred to."""
    kind = node_kind(base)
    if kind is ScalarNode:
        return _scalar(base, marks)
    if kind is SequenceNode:
        return {"type": "array", "items": _hint(get_args(base)[0], definitions), **_length(marks, "Items")}
    if get_origin(base) is MappingField:
        entry = _hint(get_args(base)[0], definitions)
        keys = {"propertyNames": _text(marks)}
        return {"type": "object", **keys, "additionalProperties": entry, **_length(marks, "Properties")}
    if base.__name__ not in definitions:
        definitions[base.__name__] = {}  # a record may refer to itself
        definitions[base.__name__] = _record(base, definitions)
    return {"$ref": f"#/$defs/{base.__name__}"}


def _scalar(base: Any, marks: tuple[Any, ...]) -> dict[str, Any]:
    words = allowed_words(base)
    if words is not None:
        return {"enum": list(words)}
    if base is BooleanField:
        return {"type": "boolean"}
    if base in (IntegerField, NumberField):
        return {"type": "integer" if base is IntegerField else "number", **_bounds(marks)}
    return _text(marks)


def _text(marks: tuple[Any, ...]) -> dict[str, Any]:
    """Text is whatever was written: to an editor `1.0` is a number and `true` a boolean."""
    for mark in marks:
        if isinstance(mark, Pattern):
            return {"type": "string", "pattern": f"^(?:{PATTERNS[mark.name].regex.pattern})$"}
    return {"type": ["string", "number", "boolean"]}


def _bounds(marks: tuple[Any, ...]) -> dict[str, Any]:
    for mark in marks:
        if isinstance(mark, ValueBounds):
            ends = {"minimum": mark.lo, "maximum": mark.hi}
            return {
                word: int(end) if end == int(end) else float(end)
                for word, end in ends.items()
                if end is not None
            }
    return {}


def _length(marks: tuple[Any, ...], what: str) -> dict[str, int]:
    for mark in marks:
        if isinstance(mark, LengthBounds):
            ends = {f"min{what}": mark.lo, f"max{what}": mark.hi}
            return {word: end for word, end in ends.items() if end is not None}
    return {}
