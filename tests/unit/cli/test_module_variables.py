"""A module with predicates of its own: proved, run to its goal, replayed, planned, predicted; or refused."""

# ruff: noqa: E501  a change stands in one line with what is said of it

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit
from tests.unit.runtime.kettle import KETTLE


@pytest.fixture
def ecms(tmp_path: Path) -> Path:
    """A folder with the kettle, certified."""
    shutil.copytree(KETTLE, tmp_path / "ecms" / "kettle")
    assert main(["verify", str(tmp_path / "ecms")]) == Exit.SUCCESS
    return tmp_path / "ecms"


def test_its_task_runs_to_its_goal_and_is_replayed(
    ecms: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ["--ecms", str(ecms), "--state", str(tmp_path / "state")]
    out = tmp_path / "out"
    run = ["run", "hot water", "--plant", "symbolic", "--gate", "checked", "--out", str(out), *options]
    assert main(run) == Exit.SUCCESS
    message = capsys.readouterr().out
    assert "measured   kettle.water_hot = true, kettle.filled = true (symbolic plant)" in message
    assert "Z3 confirmed 6 of 6 decisions" in message
    assert main(["audit", "replay", str(out / "audit.jsonl"), *options]) == Exit.SUCCESS
    assert "6 decisions reproduced; 0 differ" in capsys.readouterr().out
    readings = [
        json.loads(line)["details"]["state"]
        for line in (out / "audit.jsonl").read_text().splitlines()
        if '"event":"decision"' in line
    ]
    assert any("kettle.water_level" in one for one in readings)


def test_a_goal_over_its_predicates_is_pursued(
    ecms: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    goal = ["plan", "--goal", "kettle.water_hot", "--ecms", str(ecms), "--state", str(tmp_path / "state")]
    assert main(goal) == Exit.SUCCESS
    shown = capsys.readouterr().out
    assert shown.index("kettle.fill,") < shown.index("kettle.heat,")
    assert main([*goal, "--initial", "kettle.filled=true"]) == Exit.SUCCESS
    assert "kettle.fill," not in capsys.readouterr().out
    assert main([*goal, "--export-pddl", str(tmp_path / "pddl")]) == Exit.SUCCESS
    domain = (tmp_path / "pddl" / "domain.pddl").read_text()
    assert "(kettle--water_hot)" in domain
    assert "kettle.water_hot" not in domain


def test_its_success_is_predicted_from_the_declared_outcomes(
    ecms: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    assert main(["predict", str(ecms / "kettle"), "--format", "json"]) == Exit.SUCCESS
    (found,) = json.loads(capsys.readouterr().out)["predictions"]
    assert (found["module"], found["task"]) == ("kettle", "heat_water")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("sensors: [overhead_camera, joint_encoders]", "sensors: [joint_encoders]", "AE405"),
        ("sensors: [overhead_camera, joint_encoders]", "sensors: [overhead_camera, joint_encoders, mast_camera]", "AE404"),
        ("overhead: {width", "roof: {width", "`roof` is neither a camera of this site nor a need"),
        ("height: 240", "height: 241", "this site offers pictures of at most 320 x 240 pixels"),
        ("timeout: 200 ms", "timeout: 1001 ms", "a perceiver's timeout is above 0 s and at most 1 s"),
        ("provides: [water_hot, filled, water_level]", "provides: [water_hot, filled]", "no perceiver provides `water_level`"),
        ("entry: perceivers:see_kettle", "entry: perceivers:see", "`perceivers.py` has no function `see`"),
        ("wait: duration <= 5 s and water_level >= 20 mm", "wait: duration <= 5 s", "AE403"),
        ("precondition: filled", "precondition: pot.filled", "`pot.filled` is not declared here"),
    ],
)  # fmt: skip
def test_a_manifest_that_overreaches_is_refused_at_its_place(
    old: str, new: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = shutil.copytree(KETTLE, tmp_path / "kettle")
    text = (folder / "ecm.yaml").read_text()
    assert text.count(old) == 1
    (folder / "ecm.yaml").write_text(text.replace(old, new))
    assert main(["verify", str(folder), "--no-cache", "--no-lock"]) == Exit.REJECTED
    shown = capsys.readouterr().out
    assert message in shown
    assert f"{folder}/ecm.yaml:" in shown


def test_code_of_a_perceiver_that_reaches_further_is_refused_at_its_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = shutil.copytree(KETTLE, tmp_path / "kettle")
    code = (folder / "perceivers.py").read_text()
    (folder / "perceivers.py").write_text(code.replace("np.median(", "np.memmap("))
    assert main(["verify", str(folder), "--no-cache", "--no-lock"]) == Exit.REJECTED
    shown = capsys.readouterr().out
    assert "perceiver code of `kettle` uses `memmap` of `numpy`" in shown
    assert f"{folder}/perceivers.py:" in shown
