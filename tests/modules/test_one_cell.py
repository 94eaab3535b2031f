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


@pytest.mark.physics
@pytest.mark.parametrize(
    ("plant", "instruction", "goal"),
    [
        ("kinematic", ALL, ()),
        pytest.param("physics", ALL, (), marks=pytest.mark.deep),
        pytest.param("physics", BACKWARDS, (), marks=pytest.mark.deep),
        pytest.param("physics", "make dumplings", GOAL, marks=pytest.mark.deep),
    ],
)
def test_all_goals_are_reached_in_one_run(
    plant: str, instruction: str, goal: tuple[str, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = ["--out", str(tmp_path / "out"), "--state", str(tmp_path / "robot"), "--no-video"]
    ran = ["run", instruction, *goal, "--plant", plant, "--ecms", str(ROOT / "ecms"), "--seed", "701", *out]
    assert main(ran) == Exit.SUCCESS
    assert "believed true, true in the simulator" in capsys.readouterr().out
