"""`--format` and `--output` of `aeros verify`, from the command line to the file."""

from __future__ import annotations

import json
import shutil
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit

CORPUS = Path(__file__).parents[3] / "corpus"
SITE = str(CORPUS / "site" / "table.yaml")
REJECTED = str(CORPUS / "rejected" / "safety" / "fast_near_a_person")
ACCEPTED = str(CORPUS / "accepted" / "left_to_the_gate")
NEEDS_THE_SOLVER = str(CORPUS / "accepted" / "norm_of_a_difference")
FORMATS = ("text", "json", "sarif", "junit", "github")


@pytest.fixture(scope="module")
def answers(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder for solver answers, which are the same in every format."""
    return tmp_path_factory.mktemp("answers")


@pytest.fixture(autouse=True)
def _shared_answers(answers: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("AEROS_CACHE", str(answers))


def verify(*arguments: object) -> int:
    return main(["verify", *map(str, arguments), "--site", SITE])


@pytest.mark.parametrize("format_", FORMATS)
@pytest.mark.parametrize(
    ("arguments", "status"),
    [
        ([ACCEPTED, "--no-lock"], Exit.SUCCESS),
        ([REJECTED, "--no-lock"], Exit.REJECTED),
        ([NEEDS_THE_SOLVER, "--no-lock", "--rlimit", "100"], Exit.UNDECIDED),
        ([ACCEPTED, "--check"], Exit.REJECTED),
    ],
    ids=["proved", "rejected", "undecided", "no certificate"],
)
def test_the_exit_code_is_the_same_in_every_format(
    format_: str, arguments: list[str], status: Exit, tmp_path: Path
) -> None:
    assert verify(*arguments, "--format", format_) == status
    assert verify(*arguments, "--format", format_, "--output", tmp_path / "report") == status


@pytest.mark.parametrize("format_", FORMATS)
def test_the_file_holds_the_report_and_standard_output_the_text(
    format_: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    verify(REJECTED, "--no-lock")
    text = capsys.readouterr().out
    verify(REJECTED, "--no-lock", "--format", format_)
    printed = capsys.readouterr().out
    verify(REJECTED, "--no-lock", "--format", format_, "--output", tmp_path / "report")
    assert capsys.readouterr().out == text
    assert (tmp_path / "report").read_text(encoding="utf-8") == printed


def test_each_format_is_what_it_says(capsys: pytest.CaptureFixture[str]) -> None:
    shown = {}
    for format_ in FORMATS:
        verify(REJECTED, "--no-lock", "--format", format_)
        shown[format_] = capsys.readouterr().out
    assert shown["text"].startswith("error[AE501] ")
    assert json.loads(shown["json"])["schema"] == "aeros/report/1"
    assert json.loads(shown["sarif"])["version"] == "2.1.0"
    assert shown["github"].startswith("::error file=")
    assert ET.fromstring(shown["junit"]).tag == "testsuites"  # noqa: S314  our own output


@pytest.mark.parametrize(
    ("name", "reason"),
    [("nowhere/report.json", "its folder does not exist"), ("", "is a folder")],
)
def test_a_place_where_no_file_can_be_is_a_usage_error(
    name: str, reason: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        verify(ACCEPTED, "--no-lock", "--output", f"{tmp_path}/{name}")
    assert ended.value.code == Exit.USAGE
    assert reason in capsys.readouterr().err


def test_a_report_that_cannot_be_written_is_never_a_pass(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_text", full)
    target = tmp_path / "report\x1b"
    assert verify(ACCEPTED, "--no-lock", "--format", "junit", "--output", target) == Exit.USAGE
    shown = capsys.readouterr()
    assert "report\\x1b`: No space left on device" in shown.err
    assert shown.out == ""


def test_colours_never_reach_a_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    verify(shutil.copytree(REJECTED, tmp_path / "module"), "--output", tmp_path / "report")
    assert "\x1b" not in (tmp_path / "report").read_text(encoding="utf-8")
