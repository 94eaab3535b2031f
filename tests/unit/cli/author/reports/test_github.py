"""Workflow commands: what a runner of GitHub Actions reads back is the diagnostic."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.cli.author.reports.github import as_github
from aeros.spec.diagnostics.codes import Diagnostic, Severity
from tests.unit.cli.author.reports.results import CORPUS, RUNS, diagnostic_at, result_of, result_with

_COMMAND = re.compile(r"::(error|warning|notice) (.*?)::(.*)")


def parsed(line: str) -> tuple[str, dict[str, str], str]:
    """Read a command as the runner does: ActionCommand.cs splits first and takes the escapes back last."""
    match = _COMMAND.fullmatch(line)
    assert match is not None, line
    pairs = (part.split("=", 1) for part in match[2].split(","))
    return match[1], {key: unescaped(value) for key, value in pairs}, unescaped(match[3])


def unescaped(text: str) -> str:
    return re.sub("%(0D|0A|3A|2C|25)", lambda match: chr(int(match[1], 16)), text)


@pytest.fixture(autouse=True)
def in_the_corpus(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(CORPUS)


@pytest.mark.parametrize("name", RUNS)
def test_each_diagnostic_is_a_command_at_its_line(name: str) -> None:
    result = result_of(name)
    commands = [parsed(line) for line in as_github(result).splitlines()]
    expected = [problem.diagnostic for problem in result.problems]
    assert sorted(one["title"] for _, one, _ in commands) == sorted(one.code for one in expected)
    places = [str(one.primary.span.line) for one in expected if one.primary is not None]
    assert sorted(one["line"] for _, one, _ in commands if "line" in one) == sorted(places)
    for _, one, _ in commands:
        if "file" in one:
            assert Path(one["file"]).exists() or one["file"].endswith("ecm.lock"), one["file"]


def test_a_command_has_place_code_and_message() -> None:
    found = diagnostic_at("a: 1\nb: c\n", "c", path="module/ecm.yaml")
    assert as_github(result_with(found)) == (
        "::error file=module/ecm.yaml,line=2,col=4,endColumn=5,endLine=2,title=AE101::unknown-field: wrong"
    )


def test_several_lines_have_no_columns() -> None:
    (command,) = as_github(result_with(diagnostic_at("a\nb\n", "a\nb"))).splitlines()
    _, properties, _ = parsed(command)
    assert properties == {"file": "a.yaml", "line": "1", "endLine": "2", "title": "AE101"}


def test_severities_have_their_commands_and_errors_come_first() -> None:
    severities = (Severity.NOTE, Severity.WARNING, Severity.ERROR)
    found = [diagnostic_at("a", "a", severity=severity) for severity in severities]
    commands = [parsed(line)[0] for line in as_github(result_with(*found)).splitlines()]
    assert commands == ["error", "warning", "notice"]


def test_without_diagnostics_there_are_no_commands() -> None:
    assert as_github(result_with()) == ""


def test_a_diagnostic_without_a_place_names_its_manifest() -> None:
    found = Diagnostic("AE130", "no module")
    (command,) = as_github(result_with(found, path=Path("some/module"))).splitlines()
    assert parsed(command)[1] == {"file": "some/module/ecm.yaml", "title": "AE130"}


_TEXT = st.text(st.sampled_from("aZ09é %:,=;[]%25%3A-_.#"))


@given(_TEXT, _TEXT, _TEXT.filter(lambda path: "/" not in path and path not in ("", ".", "..")))
def test_every_text_comes_back_from_one_line(headline: str, note: str, name: str) -> None:
    found = Diagnostic("AE101", headline, notes=(f"first\n{note}",))
    text = as_github(result_with(found, path=Path(name)))
    assert len(text.split("\n")) == 1
    severity, properties, message = parsed(text)
    assert severity == "error"
    assert properties["file"] == f"{name}/ecm.yaml"
    assert message == f"unknown-field: {headline}\nnote: first\n{note}"


def test_a_hostile_text_cannot_start_a_command_of_its_own() -> None:
    found = diagnostic_at("a", "a", headline="x\n::error::y\r::stop-commands::z", path="a,title=b::c%0A.yaml")
    (command,) = as_github(result_with(found)).splitlines()
    assert parsed(command)[1]["file"] == "a,title=b::c%0A.yaml"
