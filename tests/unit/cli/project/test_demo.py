"""`aeros demo` proves and runs what comes with AEROS, wherever it is started."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.cli.project import demo
from aeros.exit_codes import Exit


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Start in an empty folder, with no simulator installed."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(demo, "best_plant", lambda: "symbolic")


def test_it_proves_and_runs_and_shows_both_commands(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["demo", "clean the table", "--out", "out"]) == Exit.SUCCESS
    shown = capsys.readouterr().out
    assert "$ aeros verify " in shown
    assert "$ aeros run 'clean the table' --ecms " in shown
    assert "goal reached" in shown
    assert "For physics and films: `pip install" in shown
    assert (Path("out") / "audit.jsonl").exists()


def test_the_settings_of_a_project_are_not_its(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", "project", "cell", "--parent", "."]) == Exit.SUCCESS
    (Path("cell") / "aeros.toml").rename("aeros.toml")
    (Path("cell") / "cell.yaml").rename("cell.yaml")
    (Path("cell") / "modules").rename("modules")
    assert main(["demo", "clean the table", "--out", "out"]) == Exit.SUCCESS
    assert "panda_cell" in capsys.readouterr().out


def test_a_failure_ends_it_with_that_code(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["demo", "clean the moon"]) == Exit.REJECTED
    assert "does not know `moon`" in capsys.readouterr().err
