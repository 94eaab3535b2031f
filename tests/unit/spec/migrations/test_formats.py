from __future__ import annotations

import hashlib
from pathlib import PurePath
from typing import get_args, get_type_hints

import pytest

from aeros.agent.memory import schema as memory_schema
from aeros.runtime.audit import checkpoints
from aeros.runtime.audit.check import GENESIS
from aeros.spec.declared.json_schema import FILES
from aeros.spec.migrations import formats
from aeros.spec.migrations.format import Format, Kind
from aeros.spec.migrations.rewriting import rewrite


def test_format_names_are_unique() -> None:
    assert len({one.name for one in formats.FORMATS}) == len(formats.FORMATS)


def test_every_format_of_the_module_is_registered() -> None:
    defined = {one.name for one in vars(formats).values() if isinstance(one, Format)}
    assert defined == {one.name for one in formats.FORMATS}


@pytest.mark.parametrize("name", FILES)
def test_a_declared_file_names_the_current_version(name: str) -> None:
    hint = get_type_hints(FILES[name])["schema"]
    assert get_args(hint) == (formats.format_named(name).schema,)


@pytest.mark.parametrize("one", formats.FORMATS, ids=lambda one: one.name)
def test_a_version_after_the_first_has_a_step_or_the_format_a_cure(one: Format) -> None:
    assert one.versions[0].step is None
    assert bool(one.cure) or all(version.step is not None for version in one.versions[1:])


def test_versions_kept_elsewhere_are_those_of_the_registry() -> None:
    assert len(memory_schema._MIGRATIONS) == formats.MEMORY.version
    assert hashlib.sha256(str(formats.AUDIT.schema).encode()).hexdigest() == GENESIS
    assert formats.AUDIT_CHECKPOINT.schema == checkpoints._FORMAT


def test_only_yaml_json_and_lines_are_rewritten() -> None:
    for one in formats.FORMATS:
        if one.kind in (Kind.DATABASE, Kind.OTHER):
            assert one.cure


def test_a_format_is_found_by_its_name() -> None:
    for one in formats.FORMATS:
        assert formats.format_named(one.name) is one
    with pytest.raises(StopIteration):
        formats.format_named("unheard-of")


def test_a_program_of_today_writes_these_versions() -> None:
    """A version that changes needs a step or a cure, a page and a fragment of the changelog."""
    later = {one.name: one.version for one in formats.FORMATS if one.version != 1}
    assert later == {
        "ecm": 2,
        "scene": 2,
        "checkpoint": 9,
        "run": 3,
        "crashes": 2,
        "plant-log": 2,
        "memory-database": 7,
        "registry-database": 5,
        "trace": 2,
    }


def test_a_scene_of_the_first_version_is_one_of_the_second() -> None:
    text = "# Things.\nschema: aeros/scene/1 # old\ndescription: A crate.\n"
    found = rewrite(PurePath("crate.yaml"), text, formats.SCENE)
    assert found.text == text.replace("scene/1", "scene/2")
    assert found.changes == (formats.SCENE.versions[1].change,)
