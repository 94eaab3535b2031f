"""Each field of the schemas, changed once, is found; the order of lists counts, that of mappings does not."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import pytest

from aeros.spec.declared.ecm import Ecm
from aeros.spec.declared.site import Site
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.difference.declared_differences import declared_differences, span_of
from aeros.spec.text.fields import MappingField, TextField
from tests.unit.spec.difference.schema_instances import NODE, SPAN, instance, place, schema_paths

PATHS = [(schema, path) for schema in (Ecm, Site) for path in schema_paths(schema)]


def found(old: Any, new: Any) -> list[str]:
    return [".".join(one.pattern) for one in declared_differences(old, new)]


def test_the_schemas_have_the_fields_that_are_compared() -> None:
    assert len(PATHS) > 300
    paths = {path for _, path in PATHS}
    assert {"needs.*.sees", "permissions.worker.memory", "actions.*.tool.http", "motion.base.speed"} <= paths
    assert "compositions.*.do.seq.*.seq.*.skill" not in paths
    assert "compositions.*.do.seq.*.skill" in paths


@pytest.mark.parametrize("schema", [Ecm, Site])
def test_equal_files_have_no_difference(schema: Any) -> None:
    assert found(instance(schema), instance(schema)) == []


@pytest.mark.parametrize(("schema", "path"), PATHS, ids=[path for _, path in PATHS])
def test_each_field_that_changes_is_found(schema: Any, path: str) -> None:
    differences = found(instance(schema), instance(schema, changed=path))
    if path.endswith(".*.id"):  # entries are compared by their ids
        assert differences == [path.removesuffix(".id")] * 2
    else:
        assert differences == [path]


@pytest.mark.parametrize(("schema", "path"), PATHS, ids=[path for _, path in PATHS])
def test_each_field_that_is_removed_or_new_is_found(schema: Any, path: str) -> None:
    whole, less = instance(schema), instance(schema, removed=path)
    for old, new in ((whole, less), (less, whole)):
        assert path in found(old, new) or path.removesuffix(".id") in found(old, new)


def text(value: str, at: SourceSpan = SPAN) -> TextField:
    return TextField(value, at, NODE)


@dataclass(frozen=True)
class Thing:
    span: SourceSpan
    id: TextField
    names: tuple[TextField, ...] = ()


@dataclass(frozen=True)
class Things:
    listed: tuple[Thing, ...] = ()
    named: MappingField[TextField] = field(default=MappingField())


A, B = (Thing(SPAN, text(name)) for name in "ab")


def test_entries_with_ids_are_compared_by_them_and_in_their_order() -> None:
    assert found(Things((A, B)), Things((B,))) == ["listed.*"]
    (gone,) = declared_differences(Things((A, B)), Things((B,)))
    assert (gone.path, gone.is_of_presence, gone.new) == (("listed", "a"), True, None)
    assert found(Things((A, B)), Things((B, A))) == ["listed"]


def test_a_list_of_names_is_compared_as_a_whole() -> None:
    one, other = (Things((replace(A, names=tuple(map(text, names))),)) for names in ("xy", "yx"))
    assert found(one, other) == ["listed.*.names"]


def test_a_mapping_has_no_order_and_a_new_key_is_shown() -> None:
    x, y = ((text(name, place(5, 7)), text(name)) for name in "xy")
    assert found(Things(named=MappingField((x, y))), Things(named=MappingField((y, x)))) == []
    (new,) = declared_differences(Things(), Things(named=MappingField((x,))))
    assert (new.path, new.pattern) == (("named", "x"), ("named", "*"))
    assert (new.old_place, new.new_place) == (None, place(5, 7))


def test_the_place_of_a_list_is_that_of_its_entries() -> None:
    assert span_of((text("a", place(1, 2)), text("b", place(4, 6)))) == place(1, 6)
    assert span_of(()) is None
    assert span_of(None) is None
