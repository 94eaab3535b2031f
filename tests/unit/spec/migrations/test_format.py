"""A format recognises its version, and says what to do with a file of another one."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.migrations import formats
from aeros.spec.migrations.format import Format, FormatVersionError, Kind, Version, parse_schema


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
        ({"schema": "aeros/ecm/2"}, None),
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
    ("format_", "schema", "message"),
    [
        (formats.RUN, "aeros/run/4", "was written by a newer AEROS.+; install a newer AEROS"),
        (formats.CRASHES, "aeros/crashes/1", "is an older format.+; run `aeros migrate state/it.json`"),
        (formats.CERTIFICATE, "aeros/certificate/0", "is an older format.+; run `aeros verify`"),
        (formats.RUN, "aeros/other/1", "its `schema` is not `aeros/run/3`"),
    ],
)
def test_a_file_of_another_version_is_refused_with_cause_and_cure(
    format_: Format, schema: str, message: str
) -> None:
    with pytest.raises(FormatVersionError, match=f"`state/it.json` cannot be read: .*{message}"):
        format_.require_current({"schema": schema}, "state/it.json")


def _upper(text: str) -> str:
    return text.upper()


NAMED = Format("it", "it", (), Kind.JSON, (Version("zero"), Version("one", _upper)), first=0)
NUMBERED = Format("it", "it", (), Kind.JSON, (Version("one"), Version("two", _upper)), is_numbered=True)


def test_the_current_version_is_that_of_the_last_listed() -> None:
    assert (NAMED.version, NAMED.schema, NAMED.schema_of(0)) == (1, "aeros/it/1", "aeros/it/0")
    assert (NUMBERED.version, NUMBERED.schema, NUMBERED.schema_of(1)) == (2, 2, 1)


def test_a_step_leads_to_each_version_after_the_first() -> None:
    assert NAMED.step_to(1) is NUMBERED.step_to(2) is _upper
    for one, version in ((NAMED, 0), (NAMED, 2), (NUMBERED, 1), (NUMBERED, 3)):
        with pytest.raises(MisuseError, match=f"no step leads to version {version} of format it"):
            one.step_to(version)


@pytest.mark.parametrize("schema", [-1, True, "2", 2.0, "aeros/it/2"])
def test_a_numbered_version_is_a_whole_number_from_zero(schema: object) -> None:
    assert NUMBERED.version_from_schema(schema) is None
    assert [NUMBERED.version_from_schema(version) for version in (0, 2, 99)] == [0, 2, 99]


def test_a_file_of_the_current_version_is_not_refused() -> None:
    NAMED.require_current({"schema": "aeros/it/1"}, "it.json")
    NUMBERED.require_current({"schema": 2}, "it.json")


def test_a_refusal_says_both_versions_and_the_cure() -> None:
    assert NAMED.refusal(0, "it.json") == (
        "`aeros/it/0` is an older format, and this AEROS reads `aeros/it/1`",
        "run `aeros migrate it.json`",
    )
    assert NUMBERED.refusal(3, "it.json") == (
        "`3` was written by a newer AEROS, and this one reads `2`",
        "install a newer AEROS",
    )


@pytest.mark.parametrize(
    "text",
    [None, 1, "", "aeros/it", "aeros/It/1", "aeros/it/01", "aeros/it/-1", "aeros/it/12345", "aeros/it/1\n"],
)
def test_text_of_another_form_is_no_schema(text: object) -> None:
    assert parse_schema(text) is None


@given(name=st.from_regex(r"[a-z][a-z-]*", fullmatch=True), version=st.integers(0, 9999))
def test_every_schema_that_is_written_is_read(name: str, version: int) -> None:
    assert parse_schema(f"aeros/{name}/{version}") == (name, version)
