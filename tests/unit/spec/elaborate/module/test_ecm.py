"""Modules as a whole: metadata, files of models, and every fault at once."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.spec.faults import messages_of_module


def test_a_module_without_faults_gives_no_diagnostics(tmp_path: Path) -> None:
    assert messages_of_module(tmp_path) == []


@pytest.mark.parametrize("name", ["a" * 300, "/etc/hostname", "..", "../module/skills.py", ".", ""])
def test_a_file_of_a_tool_is_inside_the_module(tmp_path: Path, name: str) -> None:
    tool = f'\nmodels:\n  finder: {{description: finds dirt, kind: file, file: "{name}"}}\n\npermissions:'
    (message,) = messages_of_module(tmp_path, ("\npermissions:", tool))
    assert message.startswith("error[AE131] missing-file: ")


def test_every_fault_of_a_module_is_reported_at_once(tmp_path: Path) -> None:
    message = messages_of_module(
        tmp_path,
        ("version: 1.0.0", "version: one"),
        ("license: Apache-2.0", "license: none"),
        ("entry: skills:tidy", "entry: skills:tidy\n    precondition: table_tidied"),
        ("resources: [arm]", "resources: [leg]"),
        ("timeout: 30 s", "timeout: 30 m"),
        ('aeros: ">=0.1"', 'aeros: "0.1 or so"'),
    )
    assert sorted(line.partition("]")[0].partition("[")[2] for line in message) == [
        "AE122",
        "AE125",
        "AE125",
        "AE132",
        "AE202",
        "AE204",
    ]


@pytest.mark.parametrize("version", ["9" * 5000 + ".0", "1.0.0+" + "a" * 200, '"1.0.0\\n"', '" 1.0.0"'])
def test_a_version_is_one_short_line(tmp_path: Path, version: str) -> None:
    messages = messages_of_module(tmp_path, ("version: 1.0.0", f"version: {version}"))
    assert [line.partition(":")[0] for line in messages] == ["error[AE125] malformed-version"]


def test_a_range_of_versions_has_numbers_that_python_reads(tmp_path: Path) -> None:
    messages = messages_of_module(tmp_path, ('aeros: ">=0.1"', f'aeros: ">=0.1,<{"1" * 5000}"'))
    assert [line.partition(":")[0] for line in messages] == ["error[AE125] malformed-version"]


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ("license: Apache-2.0", 'license: "Apache-2.0\\n"', "AE132"),
        ("license: Apache-2.0", f"license: MIT{' OR MIT' * 100}", "AE132"),
        ("timeout: 30 s", "timeout: 1e-400 s", "AE207"),
        ("timeout: 30 s", "timeout: 1e-308 ms", "AE207"),
        ("timeout: 30 s", "timeout: 1e400 s", "AE207"),
        ("resources: [arm]", f"resources: [{'a' * 129}]", "AE105"),
    ],
)
def test_code_is_read_as_a_person_sees_it(tmp_path: Path, old: str, new: str, code: str) -> None:
    messages = messages_of_module(tmp_path, (old, new))
    assert [line.partition("]")[0].partition("[")[2] for line in messages] == [code]


def test_a_capability_is_provided_by_skills_of_the_module(tmp_path: Path) -> None:
    (message,) = messages_of_module(tmp_path, ("provided_by: [tidy]", "provided_by: []"))
    assert message == "error[AE112] wrong-length: a capability is provided by at least one skill"
    (message,) = messages_of_module(tmp_path / "again", ("provided_by: [tidy]", "provided_by: [tidi]"))
    assert message.endswith("`tidi` is not a skill or composition of this module")
