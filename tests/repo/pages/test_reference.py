"""The pages of docs/reference/ agree with the schemas: fields, types, meanings, examples.

An example comes from the field's own explanation, or else it is the shortest that a file of this
repository holds: what is shown is always something that somebody could write.

    AEROS_UPDATE_GOLDEN=1 pytest tests/repo     rewrites the pages, and fails
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from dataclasses import make_dataclass
from typing import Any, get_args, get_origin

import pytest

from aeros.spec.declared.decode import decode
from aeros.spec.declared.json_schema import FILES
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.source import Source, SourceSpan
from aeros.spec.text.fields import (
    PATTERNS,
    BooleanField,
    ExpressionField,
    IntegerField,
    LengthBounds,
    MappingField,
    NumberField,
    Pattern,
    TextField,
    ValueBounds,
)
from aeros.spec.text.files import read_source
from aeros.spec.text.nodes import MappingNode, Node, ScalarNode, SequenceNode
from aeros.spec.text.schema_hints import (
    SchemaField,
    admitted_forms,
    allowed_words,
    fields_of,
    node_kind,
    split_annotated,
)
from aeros.spec.text.yaml_reader import read_yaml
from tests.repo.tree import ROOT, check_generated, text_of

_WHOLE = {
    "ecm": "tests/corpus/accepted/left_to_the_gate/ecm.yaml",
    "site": "tests/corpus/site/table.yaml",
    "overlay": "tests/corpus/overlay/table.yaml",
    "people": "aeros/people/across_the_room.yaml",
    "faults": "ecms/fetch_object/faults/object_slips.yaml",
    "robot": "aeros/robots/panda.yaml",
    "scene": "ecms/fetch_object/scenes/fetch.yaml",
    "tests": "docs/examples/panda_cell_tests.yaml",
}
_SAMPLES = {
    "ecm": ("ecms/*/ecm.yaml", "tests/corpus/accepted/*/ecm.yaml"),
    "site": ("aeros/sites/*.yaml", "tests/corpus/site/*.yaml", "tests/corpus/accepted/*/site.yaml"),
    "overlay": ("tests/corpus/overlay/*.yaml",),
    "people": ("aeros/people/*.yaml",),
    "faults": ("aeros/faults/*.yaml", "ecms/*/faults/*.yaml"),
    "robot": ("aeros/robots/*.yaml",),
    "scene": ("aeros/scenes/*.yaml", "ecms/*/scenes/*.yaml"),
    "tests": ("docs/examples/*.yaml", "tests/unit/cli/author/site_tests/*.yaml"),
}
_LONGEST_EXAMPLE = 80
_SCALARS = {
    BooleanField: "`true` or `false`",
    IntegerField: "integer",
    NumberField: "number",
    ExpressionField: "[expression](../language.md)",
}
_AS_IN = re.compile(r",? as in `(?P<example>[^`]+)`")


def _records(schema: type) -> list[type]:
    """The schema and every record below it, each once, in the order in which they are met."""
    found: dict[type, None] = {}

    def visit(hint: Any) -> None:
        for base, _ in map(split_annotated, admitted_forms(hint)):
            if get_args(base) and node_kind(base) is not ScalarNode:
                visit(get_args(base)[0])
            elif node_kind(base) is MappingNode and base not in found:
                found[base] = None
                for field in fields_of(base).values():
                    visit(field.hint)

    visit(schema)
    return list(found)


def _type(hint: Any) -> str:
    return " or ".join(_form(*split_annotated(option)) for option in admitted_forms(hint))


def _form(base: Any, marks: tuple[Any, ...]) -> str:
    words = allowed_words(base)
    if words is not None:
        return ", ".join(f"`{word}`" for word in words)
    if node_kind(base) is SequenceNode:
        return f"list of {_type(get_args(base)[0])}{_extent(marks)}"
    if get_origin(base) is MappingField:
        return f"mapping from {_name(marks)} to {_type(get_args(base)[0])}{_extent(marks)}"
    if node_kind(base) is MappingNode:
        return f"[{base.__name__}](#{base.__name__.lower()})"
    return f"{_SCALARS.get(base) or _name(marks)}{_extent(marks)}"


def _name(marks: tuple[Any, ...]) -> str:
    return next((f"[{mark.name}](#forms-of-names)" for mark in marks if isinstance(mark, Pattern)), "text")


def _extent(marks: tuple[Any, ...]) -> str:
    """Bounds of a value, or how many entries there may be."""
    for mark in marks:
        if isinstance(mark, ValueBounds | LengthBounds):
            what = " entries" if isinstance(mark, LengthBounds) else ""
            lo, hi = (None if end is None else str(end) for end in (mark.lo, mark.hi))
            return (
                f", {lo} to {hi}{what}" if lo and hi else f", {lo or hi} at {'least' if lo else 'most'}{what}"
            )
    return ""


def _uses(node: Node, hint: Any) -> Iterator[tuple[type, str, str]]:
    """Every (record, field, source text of it) in a file, for what is written on one line."""
    for base, _ in map(split_annotated, admitted_forms(hint)):
        if node_kind(base) is not type(node):
            continue
        if isinstance(node, SequenceNode):
            for item in node.items:
                yield from _uses(item, get_args(base)[0])
        elif isinstance(node, MappingNode):
            fields = None if get_origin(base) is MappingField else fields_of(base)
            for key, value in node.entries:
                yield from _uses(value, fields[key.text].hint if fields else get_args(base)[0])
                text = key.span.merge(value.span).text
                if fields and "\n" not in text and len(text) <= _LONGEST_EXAMPLE:
                    yield base, key.text, text


def _examples(name: str) -> dict[tuple[type, str], str]:
    """The shortest use of each field in a file of this repository."""
    shortest: dict[tuple[type, str], str] = {}
    for path in sorted(path for pattern in _SAMPLES[name] for path in ROOT.glob(pattern)):
        node = read_yaml(read_source(path), Diagnostics())
        assert node is not None, path
        for record, field, text in _uses(node, FILES[name]):
            known = shortest.get((record, field))
            if known is None or (len(text), text) < (len(known), known):
                shortest[record, field] = text
    return shortest


def _row(name: str, field: SchemaField, used: str | None) -> str:
    match = _AS_IN.search(field.doc)
    meaning = _AS_IN.sub("", field.doc)
    example = match["example"] if match else used or ""
    if match and not example.startswith(f"{name}:"):
        key, colon, value = example.partition(": ")
        example = f'{name}: {{{key}: "{value}"}}' if colon else f"{name}: {example}"
    if not example and "…" not in field.example:
        example = f"{name}: {field.example}"
    shown = f"`{example}`" if example else ""
    needed = "required" if field.is_required else "optional"
    cells = (f"`{name}`", _type(field.hint), needed, meaning, shown)
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |\n"


def _page(name: str) -> str:
    uses = _examples(name)
    page = f"\n```yaml\n{text_of(_WHOLE[name]).rstrip()}\n```\n"
    for record in _records(FILES[name]):
        page += f"\n## {record.__name__}\n\n{(inspect.getdoc(record) or '').partition(chr(10))[0]}\n\n"
        page += "| field | type | | what it says | example |\n|---|---|---|---|---|\n"
        page += "".join(
            _row(field_name, field, uses.get((record, field_name)))
            for field_name, field in fields_of(record).items()
        )
    page += "\n## Forms of names\n\n"
    page += "".join(f"- {form}: {one.words}, as in `{one.example}`\n" for form, one in PATTERNS.items())
    return page + "\n"


@pytest.mark.parametrize("name", FILES)
def test_the_page_is_that_of_the_schema(name: str) -> None:
    check_generated(f"docs/reference/{name}.md", "fields", _page(name))


def _rows(page: str, record: type) -> dict[str, str]:
    """The example of each field in the section of `record`."""
    section = page.partition(f"\n## {record.__name__}\n")[2].partition("\n## ")[0]
    return dict(re.findall(r"^\| `(\w+)` \|.* \| (?:`(.*)`)? \|$", section, re.MULTILINE))


@pytest.mark.parametrize("name", FILES)
def test_every_field_has_its_row_and_every_example_could_be_written(name: str) -> None:
    page = _page(name)
    for record in _records(FILES[name]):
        rows, fields = _rows(page, record), fields_of(record)
        assert rows.keys() == fields.keys()
        for field_name, example in rows.items():
            alone = make_dataclass(
                "Alone", [("span", SourceSpan), (fields[field_name].attribute, fields[field_name].hint)]
            )
            if example:
                sink = Diagnostics()
                node = read_yaml(Source(field_name, example.replace("\\|", "|")), sink)
                assert node is not None, example
                assert decode(node, alone, sink) is not None, (example, list(sink))


@pytest.mark.parametrize("name", FILES)
def test_every_single_value_with_a_form_has_an_example(name: str) -> None:
    page = _page(name)
    for record in _records(FILES[name]):
        for field_name, field in fields_of(record).items():
            (base, marks), *_ = map(split_annotated, admitted_forms(field.hint))
            if node_kind(base) is ScalarNode and (marks or base not in (TextField, ExpressionField)):
                assert _rows(page, record)[field_name], (record, field_name)
