"""The shipped tasks in one run, in one world, true by the referee."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit
from tests.repo.tree import ROOT

ALL = "make dumplings, then clean the table and bring me the red can"
BACKWARDS = "bring me the red can, then clean the table, then make dumplings"
GOAL = ("--goal", "dumpling_cooked and table_wiped")


def run(instruction: str, plant: str, folder: Path, *options: str) -> int:
    out = ("--out", str(folder / "out"), "--state", str(folder / "robot"), "--no-film")
    where = ("--plant", plant, "--ecms", str(ROOT / "ecms"), "--seed", "701")
    return main(["run", instruction, *options, *where, *out])


def test_all_tasks_are_done_in_one_run_if_skills_do_as_declared(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(ALL, "symbolic", tmp_path) == Exit.SUCCESS
    printed = capsys.readouterr().out
    for module in ("make_dumplings", "clean_table", "fetch_object"):
        assert f"{module}.{module}: goal reached" in printed


@pytest.mark.physics
@pytest.mark.deep
@pytest.mark.parametrize(
    ("plant", "instruction", "goal"),
    [
        ("kinematic", ALL, ()),
        ("physics", ALL, ()),
        ("physics", BACKWARDS, ()),
        ("physics", "make dumplings", GOAL),
    ],
)
def test_all_goals_are_reached_in_one_run(
    plant: str, instruction: str, goal: tuple[str, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(instruction, plant, tmp_path, *goal) == Exit.SUCCESS
    assert "believed true, true in the simulator" in capsys.readouterr().out
