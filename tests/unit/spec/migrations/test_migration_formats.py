from __future__ import annotations

import hashlib
from typing import get_args, get_type_hints

import pytest

from aeros.agent.memory import schema as memory_schema
from aeros.runtime.audit import checkpoints
from aeros.runtime.audit.check import GENESIS
from aeros.spec.declared.json_schema import FILES
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.migrations import formats
from aeros.spec.migrations.format import Format, FormatVersionError, Kind


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


def test_there_is_no_step_to_the_first_version_or_beyond_the_last() -> None:
    for version in (1, formats.CHECKPOINT.version + 1):
        with pytest.raises(MisuseError):
            formats.CHECKPOINT.step_to(version)


@pytest.mark.parametrize(
    ("content", "version"),
    [
        ({"schema": "aeros/run/7"}, 7),
        ({}, 1),
        ([], 1),
        ({"schema": "aeros/ecm/1"}, None),
        ({"schema": 1}, None),
        ({"schema": "aeros/run/01"}, None),
        ({"schema": "aeros/run/99999"}, None),
    ],
)
def test_json_states_its_version_or_is_of_the_first(content: object, version: int | None) -> None:
    assert formats.RUN.version_of(content) == version


def test_a_file_that_must_state_its_version_has_none_without_schema() -> None:
    assert formats.CHECKPOINT.version_of({}) is None
    assert formats.CHECKPOINT.version_of({"schema": 2}) == 2
    assert formats.CHECKPOINT.version_of({"schema": True}) is None
    assert formats.ECM.version_from_schema(None) is None


@pytest.mark.parametrize(
    ("format_", "schema", "said"),
    [
        (formats.RUN, "aeros/run/2", "was written by a newer AEROS.+; install a newer AEROS"),
        (formats.CRASHES, "aeros/crashes/1", "is an older format.+; run `aeros migrate state/it.json`"),
        (formats.CERTIFICATE, "aeros/certificate/0", "is an older format.+; run `aeros verify`"),
        (formats.RUN, "aeros/other/1", "its `schema` is not `aeros/run/1`"),
    ],
)
def test_a_file_of_another_version_is_refused_with_cause_and_cure(
    format_: Format, schema: str, said: str
) -> None:
    with pytest.raises(FormatVersionError, match=f"`state/it.json` cannot be read: .*{said}"):
        format_.require_current({"schema": schema}, "state/it.json")


def test_only_yaml_json_and_lines_are_rewritten() -> None:
    for one in formats.FORMATS:
        if one.kind in (Kind.DATABASE, Kind.OTHER):
            assert one.cure
