"""`aeros run --composition`: branches at the same time, on both plants, and what a time-out leaves."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit
from aeros.runtime.audit.log import verify_log

REPOSITORY = Path(__file__).parents[4]

OPEN_HAND = """  open_hand:
    description: open the fingers, close them and open them again
    entry: skills:open_hand
    inputs:
      width: {type: real, unit: m, range: [0, 0.08]}
    outcomes: {opened: {duration: 2 s}}
    envelope:
      grip: width <= 81 mm and force <= 11 N
    actuators: [gripper]
    resources: [gripper]
    risk: medium
    timeout: 20 s

  measure_hand:
    description: say how wide to open
    entry: skills:measure_hand
    outputs:
      width: {type: real, unit: m, range: [0, 0.08]}
    outcomes: {measured: {}}
    envelope:
      grip: width <= 81 mm and force <= 11 N
    actuators: [gripper]
    resources: [gripper]
    risk: medium
    timeout: 20 s

  watch:
    description: look at the stands for a while
    entry: skills:watch
    outcomes: {watched: {duration: 4 s}}
    envelope:
      look: camera == mast
    actuators: []
    resources: [mast_camera]
    risk: low
    timeout: 20 s

  detect:
"""
AT_ONCE = """  fetch_at_once:
    description: the same, with the hand opened while the mast camera looks
    do:
      seq:
        - skill: measure_hand
        - par:
            - skill: watch
            - {skill: open_hand, inputs: {width: {from: measure_hand.width}}}
        - {skill: navigate, retry: 1}
        - {skill: detect, retry: 1, between_tries: recover}
        - {skill: grasp, retry: 1, between_tries: recover}
        - {skill: deliver, on_failure: stop}

tasks:
"""
CODE = '''

def open_hand(observed: Observation, inputs: Inputs) -> SkillBody:
    """Open the fingers, close them and open them again."""
    for width in (inputs["width"], 0.02, inputs["width"]):
        yield act("grip", width=width, force=10.0)


def watch(observed: Observation, inputs: Inputs) -> SkillBody:
    """Look again and again."""
    for _ in range(20):
        yield act("look", camera="mast")


def measure_hand(observed: Observation, inputs: Inputs) -> SkillBody:
    """Say how wide to open."""
    yield act("grip", width=0.08, force=10.0)
    return {"width": 0.0625}
'''


@pytest.fixture(scope="module")
def fetching(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """`fetch_object`, with a hand that opens while the mast camera looks; proved."""
    folder = tmp_path_factory.mktemp("modules") / "fetch_object"
    shutil.copytree(REPOSITORY / "ecms" / "fetch_object", folder)
    manifest, code = folder / "ecm.yaml", folder / "skills.py"
    text = manifest.read_text().replace(
        "recover, fetch_once]", "recover, open_hand, measure_hand, watch, fetch_once, fetch_at_once]"
    )
    text = text.replace("  detect:\n", OPEN_HAND, 1).replace("tasks:\n", AT_ONCE, 1)
    manifest.write_text(text)
    code.write_text(code.read_text() + CODE)
    assert main(["verify", str(folder)]) == Exit.SUCCESS
    return folder


def _run(folder: Path, modules: Path, *arguments: str) -> int:
    return main(
        ["run", "fetch the object", "--ecms", str(modules), "--state", str(folder / "state"),
         "--out", str(folder / "out"), "--no-film", *arguments]
    )  # fmt: skip


def _events(folder: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in (folder / "out" / "trace.jsonl").read_text().splitlines()]


def _records(folder: Path, event: str) -> list[dict[str, Any]]:
    log = folder / "out" / "audit.jsonl"
    assert verify_log(log).is_sound
    records = [json.loads(line) for line in log.read_text().splitlines()]
    return [{**one["details"], "sequence": one["sequence"]} for one in records if one["event"] == event]


@pytest.mark.parametrize("gate", ["compiled", "z3", "checked"])
def test_a_composition_reaches_the_goal_on_declared_outcomes(gate: str, tmp_path: Path) -> None:
    arguments = ("--composition", "fetch_once", "--plant", "symbolic", "--gate", gate)
    assert _run(tmp_path, REPOSITORY / "ecms", *arguments) == Exit.SUCCESS
    started = [one["details"]["skill"] for one in _events(tmp_path) if one["kind"] == "step-started"]
    assert started == [f"fetch_object.{skill}" for skill in ("navigate", "detect", "grasp", "deliver")]


@pytest.mark.parametrize(
    "plant", ["symbolic", pytest.param("physics", marks=[pytest.mark.physics, pytest.mark.deep])]
)
def test_the_hand_opens_while_the_camera_looks(plant: str, fetching: Path, tmp_path: Path) -> None:
    arguments = ("--composition", "fetch_at_once", "--plant", plant, "--gate", "checked")
    assert _run(tmp_path, fetching, *arguments) == Exit.SUCCESS
    events = _events(tmp_path)
    ended = {one["details"]["skill"]: one["time"] for one in events if one["kind"] == "step-ended"}
    began = {one["details"]["skill"]: one["time"] for one in events if one["kind"] == "step-started"}
    assert began["fetch_object.open_hand"] == began["fetch_object.watch"]
    assert began["fetch_object.watch"] == ended["fetch_object.measure_hand"]
    grips = [
        one["decided"]["parameters"]["width"]
        for one in _records(tmp_path, "decision")
        if "beside" in one and one["asked"]["kind"] == "grip"
    ]
    assert grips == [0.0625, 0.02, 0.0625]
    assert 0.0 < ended["fetch_object.open_hand"] < ended["fetch_object.watch"]
    assert began["fetch_object.detect"] == ended["fetch_object.navigate"]
    decisions = {one["sequence"]: one["asked"]["kind"] for one in _records(tmp_path, "decision")}
    beside = [
        (one["asked"]["kind"], [decisions[other] for other in one["beside"]])
        for one in _records(tmp_path, "decision")
        if "beside" in one
    ]
    assert ("grip", ["look"]) in beside
    assert all(
        "grip" not in (asked, *others) or "move_tool" not in (asked, *others) for asked, others in beside
    )
    assert (
        main(["audit", "replay", str(tmp_path / "out" / "audit.jsonl"), "--ecms", str(fetching)])
        == Exit.SUCCESS
    )


def test_a_task_that_takes_too_long_is_cancelled_and_says_so(
    fetching: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ("--composition", "fetch_at_once", "--plant", "symbolic", "--timeout", "1.7")
    assert _run(tmp_path, fetching, *arguments) == Exit.REJECTED
    assert "goal not reached: the time limit of 1.7 s has passed" in capsys.readouterr().out
    ended = [(one["skill"], one["status"]) for one in _records(tmp_path, "step-ended")]
    assert sorted(ended) == [
        ("measure_hand", "finished"),
        ("open_hand", "cancelled"),
        ("watch", "cancelled"),
    ]


def test_an_interrupted_run_leaves_everything_whole(
    fetching: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from aeros.sim.symbolic.plant import SymbolicPlant

    advance, calls = SymbolicPlant.advance, iter(range(100))

    def interrupted(*arguments: Any) -> Any:
        if next(calls) == 2:
            raise KeyboardInterrupt
        return advance(*arguments)

    monkeypatch.setattr(SymbolicPlant, "advance", interrupted)
    arguments = ("--composition", "fetch_at_once", "--plant", "symbolic")
    assert _run(tmp_path, fetching, *arguments) == Exit.INTERRUPTED
    assert sorted(one["skill"] for one in _records(tmp_path, "step-broken")) == ["open_hand", "watch"]
    assert _events(tmp_path)[-1]["kind"] == "run-interrupted"


def test_a_composition_that_is_not_there_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert _run(tmp_path, REPOSITORY / "ecms", "--composition", "fetch_one") == Exit.REJECTED
    message = capsys.readouterr().err
    assert "`fetch_object` has no composition `fetch_one`; did you mean `fetch_once`?" in message
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("text", ["0", "-1", "nan", "inf", "soon"])
def test_a_time_out_is_a_number_of_seconds(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["run", "fetch", f"--timeout={text}"])
    assert "expected a number of seconds above 0" in capsys.readouterr().err
