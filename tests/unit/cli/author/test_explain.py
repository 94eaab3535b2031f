from __future__ import annotations

import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit
from aeros.spec.diagnostics.codes import CODES

ROOT = Path(__file__).parents[4]


@pytest.mark.parametrize("asked", ["AE501", "ae501", "invariant-violated"])
def test_a_code_or_its_name_gives_its_page(asked: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", asked]) == Exit.SUCCESS
    assert capsys.readouterr().out == (ROOT / "docs" / "codes" / "AE501.md").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("asked", "suggested"),
    [("AE5O1", "AE501"), ("AE501x", "AE501"), ("invariant-violatd", "invariant-violated")],
)
def test_a_near_miss_is_asked_about(asked: str, suggested: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", asked]) == Exit.USAGE
    assert capsys.readouterr().err == f"aeros: there is no code `{asked}`; did you mean `{suggested}`?\n"


@pytest.mark.parametrize("asked", ["AE50", "ae50", "AE50x"])
def test_the_beginning_of_codes_lists_them(asked: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", asked]) == Exit.SUCCESS
    listed = [line.split()[0] for line in capsys.readouterr().out.splitlines()]
    assert listed == [f"AE50{number}" for number in range(1, 10)]


def test_a_name_without_near_misses_is_shown_harmlessly(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", "\x1b[31mwhat"]) == Exit.USAGE
    assert "\\x1b[31mwhat" in capsys.readouterr().err


def test_without_a_code_all_are_listed_by_group(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain"]) == Exit.SUCCESS
    shown = capsys.readouterr().out
    assert re.findall(r"^  (AE\d{3})", shown, re.MULTILINE) == list(CODES)
    assert re.findall(r"^(\S+)$", shown, re.MULTILINE) == list(
        dict.fromkeys(code.group for code in CODES.values())
    )


def test_an_installed_wheel_explains(tmp_path: Path) -> None:
    command = [
        sys.executable,
        "-c",
        f"from hatchling.build import build_wheel; build_wheel({str(tmp_path)!r})",
    ]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as packed:
        packed.extractall(tmp_path / "installed")
    ran = subprocess.run(
        [sys.executable, "-m", "aeros", "explain", "AE501"],
        cwd=tmp_path / "installed",
        check=True,
        capture_output=True,
        text=True,
    )
    assert ran.stdout == (ROOT / "docs" / "codes" / "AE501.md").read_text(encoding="utf-8")
