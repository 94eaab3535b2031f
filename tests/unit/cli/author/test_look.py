"""`aeros look`: values of perceivers beside the truth, saved pictures, and the exit code."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from aeros.cli.main import main
from tests.repo.tree import ROOT

TABLE = str(ROOT / "ecms/clean_table")
OPTIONS = ("--plant", "kinematic", "--ideal-sensors")


def test_values_are_printed_beside_the_truth_and_pictures_saved(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    robot = str(tmp_path / "robot")
    pictures = tmp_path / "pictures"
    assert main(["look", TABLE, *OPTIONS, "--state", robot, "--save", str(pictures)]) == 0
    text = capsys.readouterr().out
    assert text.startswith("clean_table: scene table, seed 0, plant kinematic\n")
    assert "overhead (table_top) at 0.00 s" in text
    assert " m ± 0.005 m (at most 0.01 m)\n" in text
    assert re.search(r"\btable_wiped +false  truth false\n", text)
    assert re.search(r"\brobot_at_table +true  truth true\n", text)
    assert "[base_position = (0, -1.2, 0) m, clean_table.dock_position = " in text
    assert sorted(path.name for path in pictures.iterdir()) == [
        "table_side-depth.png",
        "table_side.png",
        "table_top-depth.png",
        "table_top.png",
    ]


def test_programs_get_the_same_as_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    robot = str(tmp_path / "robot")
    task = ["--task", "clean_table", "region=left"]
    camera = ["--camera", "overhead"]
    assert main(["look", TABLE, *OPTIONS, *task, *camera, "--state", robot, "--format", "json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["schema"], found["module"], found["scene"]) == ("aeros/look/1", "clean_table", "table")
    values = {one["variable"]: one for look in found["perceivers"] for one in look["values"]}
    assert values["clean_table.table_wiped"]["truth"] is False
    assert values["clean_table.sponge_position"]["uncertainty"] == 0.005
    assert values["clean_table.overhead_turn"]["reason"] == "not given"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([str(ROOT / "ecms")], "holds several modules; name one"),
        ([str(ROOT / "ecms/serve_table")], "neither a perceiver nor a definition"),
        (
            [TABLE, "--camera", "overhed"],
            "asks for a camera `overhed`; did you mean `overhead`?",
        ),
    ],
)
def test_a_look_that_cannot_be_is_a_usage_error(
    arguments: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["look", *arguments, "--state", str(tmp_path)]) == 2
    assert message in capsys.readouterr().err


def test_a_task_that_is_not_there_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["look", TABLE, "--task", "polish", "--state", str(tmp_path)]) == 1
    assert "polish" in capsys.readouterr().err
