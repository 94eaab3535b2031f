"""`aeros site` lists a file's site, or the one in force on the robot."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from aeros.cli.main import main
from tests.repo.tree import ROOT

TABLE = ROOT / "tests" / "corpus" / "site" / "table.yaml"
BENCH = ROOT / "docs" / "codes" / "base" / "site.yaml"


def test_a_site_file_is_listed_in_part_or_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["site", str(TABLE), "--only", "actions"]) == 0
    text = capsys.readouterr().out
    assert "\nactions\n" in text
    assert "\ninvariants\n" not in text
    assert main(["site", str(TABLE), "--format", "json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["id"] == "table"
    assert "wipe" in found["actions"]


def test_without_a_file_the_site_is_the_reference_site_or_the_one_in_force(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    state = str(tmp_path / "robot")
    assert main(["site", "--only", "cameras", "--state", state]) == 0
    assert capsys.readouterr().out.startswith("panda_cell: ")
    assert main(["policy", str(BENCH), "--state", state]) == 0
    capsys.readouterr()
    assert main(["site", "--state", state]) == 0
    assert capsys.readouterr().out.startswith("bench: ")


def test_a_faulty_site_and_an_unknown_table_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "site.yaml").write_text("schema: aeros/site/1\n")
    assert main(["site", str(tmp_path / "site.yaml")]) == 1
    assert "AE102" in capsys.readouterr().err
    assert main(["site", str(TABLE), "--only", "sponges"]) == 2
    assert "there are volumes" in capsys.readouterr().out
