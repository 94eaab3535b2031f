from __future__ import annotations

import json
from pathlib import Path

import pytest

from aeros.cli.main import main
from tests.repo.tree import ROOT

MODULE = ["--ecms", str(ROOT / "ecms/clean_table")]


def tasks(tmp_path: Path, *words: str) -> int:
    return main(["tasks", *words, *MODULE, "--state", str(tmp_path)])


def test_tasks_are_listed_with_goals_and_words(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert tasks(tmp_path) == 0
    text = capsys.readouterr().out
    assert "clean_table.clean_table\n" in text
    assert "say      clean (up|out|), " in text
    assert tasks(tmp_path, "--format", "json") == 0
    (listed,) = json.loads(capsys.readouterr().out)["tasks"]
    assert listed["task"] == "clean_table.clean_table"
    assert listed["conditions"]["the table is dirty"] == "not table_wiped"


def test_an_instruction_is_shown_as_formal_goals(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert tasks(tmp_path, "please clean the table") == 0
    assert capsys.readouterr().out.startswith("clean_table.clean_table(region = whole): ")
    assert tasks(tmp_path, "clean_table", "--format", "json") == 0
    assert len(json.loads(capsys.readouterr().out)["understood"]) == 1


def test_a_request_that_is_not_understood_is_refused_with_the_reason(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert tasks(tmp_path, "clean the moon") == 1
    assert "does not know `moon`" in capsys.readouterr().err
    assert tasks(tmp_path, "do not clean the table", "--format", "json") == 1
    refused = json.loads(capsys.readouterr().out)
    assert refused["understood"] is None
    assert "nothing moves" in refused["reason"]


def test_a_whole_number_is_listed_with_its_range_and_without_decimals(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    dumplings = ["--ecms", str(ROOT / "ecms/make_dumplings"), "--state", str(tmp_path)]
    assert main(["tasks", *dumplings]) == 0
    assert "  count    1 to 2, else 1\n" in capsys.readouterr().out
    assert main(["tasks", *dumplings, "--format", "json"]) == 0
    (listed,) = json.loads(capsys.readouterr().out)["tasks"]
    assert listed["parameters"]["count"] == {"values": [], "range": "1 to 2", "default": 1, "words": {}}
