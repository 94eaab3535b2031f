"""Sessions at a terminal: what each command prints, and its exit code, compared line by line.

Each text file here is a session: the lines that begin with `$ aeros` are run one after the other in a
folder of their own, which has the module and site of `docs/codes/base` in `base`.
"""

from __future__ import annotations

import re
import shlex
import shutil
from pathlib import Path

import pytest

from aeros.cli.main import main
from tests.repo.tree import ROOT
from tests.reports_in_full import compare_with_file

SESSIONS = sorted(Path(__file__).parent.glob("*.txt"))
_CHANGING = (
    (r"\d+(\.\d+)? m?s\b", "TIME"),
    (r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(:\d\d(\.\d+)?)?(Z|[+-]\d\d:\d\d)?", "DATE"),
    (r"\b[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}\b", "UUID"),
    (r"\b[0-9a-f]{32,64}\b|\b[0-9a-f]{12}…", "DIGEST"),
    (r'"time": \d{9,}\.\d+', '"time": TIME'),
    (r"memory \d+ of", "memory SOME of"),
    (r"longest answer \S+ of", "longest answer SOME of"),
    (r" isolation +\{.*", " isolation LAYERS"),
    (r"\d+ KB", "SIZE"),
)
"""Patterns of what differs between runs."""


def _run(line: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> str:
    """Run a command line, and write its exit code, output and errors."""
    try:
        code = main(shlex.split(line.removeprefix("$ aeros")))
    except SystemExit as end:
        code = int(end.code or 0)
    shown = capsys.readouterr()
    errors = "".join(f"! {one}\n" for one in shown.err.splitlines())
    text = f"{shown.out}{errors}".replace(str(folder), "FOLDER").replace(str(ROOT), "ROOT")
    for pattern, name in _CHANGING:
        text = re.sub(pattern, name, text)
    return f"{line}\n{text}exit code {int(code)}\n"


@pytest.mark.parametrize("session", SESSIONS, ids=[one.stem for one in SESSIONS])
def test_a_session(
    session: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    monkeypatch.setenv("HOME", str(tmp_path))
    shutil.copytree(ROOT / "docs" / "codes" / "base", "base")
    lines = [line for line in session.read_text("utf-8").splitlines() if line.startswith("$ aeros")]
    assert lines
    compare_with_file(session, "\n".join(_run(line, tmp_path, capsys) for line in lines))
