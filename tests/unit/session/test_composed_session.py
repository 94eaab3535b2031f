"""A module for a task of its own, with its predicate, detector, object and numbers, and a shipped module.

It is written as a new user would: nothing of `aeros` and no site is changed for it.
"""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit
from tests.repo.tree import ROOT

MODULE = Path(__file__).with_name("data") / "lay_block"
SHIPPED = ROOT / "ecms" / "clean_table"


def aeros(*arguments: str, **paths: Path) -> int:
    options = [part for name, path in paths.items() for part in (f"--{name}", str(path))]
    return main([*arguments, *options])


@pytest.mark.physics
def test_it_is_configured_composed_and_true_in_the_simulator(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    state = tmp_path / "robot"
    assert aeros("install", str(MODULE), state=state) == Exit.REJECTED  # the other is not there yet
    for folder in (SHIPPED, MODULE):
        assert aeros("install", str(folder), state=state) == Exit.SUCCESS
    assert aeros("configure", "clean_table", state=state) == Exit.SUCCESS
    assert aeros("configure", "lay_block", "--bind", "area=table_area", state=state) == Exit.SUCCESS
    for name in ("clean_table", "lay_block"):
        assert aeros("activate", name, state=state) == Exit.SUCCESS
    run = ("run", "lay the purple block on its spot", "--seed", "4")
    assert aeros(*run, state=state, out=tmp_path / "run") == Exit.SUCCESS
    assert "goal reached: believed true, true in the simulator" in capsys.readouterr().out
    records = [json.loads(line) for line in (tmp_path / "run" / "audit.jsonl").read_text().splitlines()]
    ran = [one["details"] for one in records if one["event"] == "step-ended"]
    assert {one["module"] for one in ran} == {"clean_table", "lay_block"}


def test_a_picture_that_no_camera_offers_is_refused_before_it_runs(tmp_path: Path) -> None:
    folder = tmp_path / "lay_block"
    folder.mkdir()
    for path in MODULE.iterdir():
        if path.is_file():
            text = path.read_text().replace("width: 320, height: 240", "width: 640, height: 480")
            (folder / path.name).write_text(text)
    bound = ("--bind", "lay_block.area=table_area", "--no-lock")
    assert main(["verify", str(folder), *bound]) == Exit.REJECTED
