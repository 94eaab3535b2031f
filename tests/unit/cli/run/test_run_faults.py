"""`aeros run --faults`: the trace reports what goes wrong, and the agent puts it right."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit

ROOT = Path(__file__).parents[4]


def arguments(folder: Path, instruction: str, faults: str, *more: str) -> list[str]:
    return ["run", instruction, "--ecms", str(ROOT / "ecms"), "--state", str(folder / "state"),
            "--out", str(folder / "out"), "--no-film", "--faults", faults, *more]  # fmt: skip


def trace_of(folder: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in (folder / "out" / "trace.jsonl").read_text().splitlines()]


def write(folder: Path, faults: str) -> str:
    path = folder / "faults.yaml"
    path.write_text(f"schema: aeros/faults/1\nfaults:\n{faults}")
    return str(path)


RECOVERED = {
    "a wrapper that is knocked under the handle, where it cannot be lifted, is slid to its place": (
        "make dumplings",
        4,
        "{at: {skill: make_dumplings.prepare, after: 13 s}, rate: 1, at_most: 1, "
        "bump: {thing: wrapper, impulse: 0.065 N*s, direction: [-1, 0, 0]}}",
        ["prepare laid_askew", "recover aligned", "wrap wrapped", "boil cooked"],
    ),
    "a wrapper that fell and stands beside the press is pushed over, past its end, and fetched": (
        "make dumplings",
        1,
        "{at: {skill: make_dumplings.prepare, after: 13 s}, rate: 1, at_most: 1, "
        "bump: {thing: wrapper, impulse: 0.065 N*s, direction: [0.35, -1, 0]}}",
        ["prepare missed", "prepare laid_out", "wrap wrapped", "boil cooked"],
    ),
    "a sponge that is dropped is taken again": (
        "clean the table",
        0,
        "{at: {skill: clean_table.wipe, once: holding, after: 3 s}, rate: 1, at_most: 1, "
        "loosen: {force: 0 N, lasts: 500 ms}}",
        ["wipe streaky", "wipe wiped", "organize organized", "verify verified"],
    ),
    "an arm that lacked strength and was stopped moves on when it has it again": (
        "clean the table",
        0,
        "{at: {skill: clean_table.wipe, once: holding, after: 3 s}, rate: 1, at_most: 1, "
        "weaken: {torque: 0.2, lasts: 300 ms}}",
        ["wipe streaky", "wipe wiped", "organize organized", "verify verified"],
    ),
    "a table that glare hides from the camera is looked at again": (
        "clean the table",
        0,
        "{at: {look: table_side}, rate: 1, at_most: 1, miss: {}}",
        ["wipe wiped", "organize organized", "verify unclean", "verify verified"],
    ),
    "an object that slips is grasped again": (
        "fetch the object",
        0,
        "{at: {skill: fetch_object.grasp, once: holding, after: 500 ms}, rate: 1, at_most: 1, "
        "slip: {friction: 0, lasts: 1 s}}",
        ["navigate arrived", "detect seen", "grasp grasped", "deliver delivered"],
    ),
    "an object that falls over on its stand is taken up as it lies": (
        "fetch the object",
        1,
        "{at: {skill: fetch_object.grasp, once: holding, after: 850 ms}, rate: 1, at_most: 1, "
        "slip: {friction: 0, lasts: 1 s}}",
        ["navigate arrived", "detect seen", "grasp missed", "grasp grasped", "deliver delivered"],
    ),
    "an object that is dropped on the way is found on the floor": (
        "fetch the object",
        0,
        "{at: {skill: fetch_object.deliver, after: 5 s}, rate: 1, at_most: 1, "
        "slip: {friction: 0, lasts: 1 s}}",
        ["navigate arrived", "detect seen", "grasp grasped", "deliver dropped", "navigate arrived",
         "detect seen", "grasp grasped", "deliver delivered"],
    ),
    "an object that falls down beside its stand is found there": (
        "fetch the object",
        1,
        "{at: {skill: fetch_object.deliver, after: 2 s}, rate: 1, at_most: 1, "
        "slip: {friction: 0, lasts: 1 s}}",
        ["navigate arrived", "detect seen", "grasp grasped", "deliver lost", "detect seen",
         "grasp grasped", "deliver delivered"],
    ),
    "an object that is not seen is looked at again": (
        "fetch the object",
        0,
        "{at: {look: mast}, rate: 1, at_most: 1, miss: {}}",
        ["navigate arrived", "detect seen", "grasp grasped", "deliver delivered"],
    ),
    "an object that seems to be elsewhere is grasped by its other sides": (
        "fetch the object",
        0,
        "{at: {look: hand}, rate: 1, at_most: 1, misplace: {by: 60 mm}}",
        ["navigate arrived", "detect seen", "grasp grasped", "deliver delivered"],
    ),
    "pictures that come late, noisy and half of the time not at all are taken until they come": (
        "fetch the object",
        0,
        "{at: {skill: fetch_object.detect}, rate: 1, at_most: 1, "
        "misread: {of: mast, noise: 5 mm, latency: 500 ms, dropout: 0.5, lasts: 60 s}}",
        ["navigate arrived", "detect seen", "grasp grasped", "deliver delivered"],
    ),
    "an arm that follows late and was stopped grasps when it follows again": (
        "fetch the object",
        0,
        "{at: {skill: fetch_object.grasp, after: 2 s}, rate: 1, at_most: 1, "
        "delay: {by: 25 ms, lasts: 2 s}}",
        ["navigate arrived", "detect seen", "grasp missed", "grasp missed", "recover ready",
         "grasp grasped", "deliver delivered"],
    ),
    "an arm that follows late and was stopped with the sponge wipes when it follows again": (
        "clean the table",
        0,
        "{at: {skill: clean_table.wipe, once: holding, after: 3 s}, rate: 1, at_most: 1, "
        "delay: {by: 25 ms, lasts: 2 s}}",
        ["wipe streaky", "wipe streaky", "recover returned", "wipe wiped", "organize organized",
         "verify verified"],
    ),
}  # fmt: skip


def truth_at_the_end(monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Return a list that gets True at the end if bodies and joints, not measurements, show the task done."""
    from aeros.sim.physics import PhysicsPlant
    from tests.unit.sim.ground_truth import is_done

    done: list[bool] = []
    close = PhysicsPlant.close

    def closed(plant: PhysicsPlant) -> None:
        if not done:
            done.append(is_done(plant))
        close(plant)

    monkeypatch.setattr(PhysicsPlant, "close", closed)
    return done


_EACH_PUSH = "an object that slips is grasped again"
"""The recovery that each push tries. The kinds of faults have their own tests of the plant."""


@pytest.mark.physics
@pytest.mark.parametrize(
    "case", [pytest.param(one, marks=() if one == _EACH_PUSH else pytest.mark.deep) for one in RECOVERED]
)
def test_the_agent_puts_right(case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    instruction, seed, fault, steps = RECOVERED[case]
    faults = write(tmp_path, f"  it: {fault}\n")
    done = truth_at_the_end(monkeypatch)
    assert main(arguments(tmp_path, instruction, faults, "--seed", str(seed))) == Exit.SUCCESS
    trace = trace_of(tmp_path)
    (fault_event,) = [event for event in trace if event["kind"] == "fault-started"]
    assert fault_event["details"] == {"fault": "it", "opportunity": 1}
    assert [
        f"{event['details']['skill'].partition('.')[2]} {event['details']['outcome']}"
        for event in trace
        if event["kind"] == "step-ended"
    ] == steps
    assert done == [True]


def test_a_file_that_is_wrong_is_refused_before_anything_is_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    faults = write(tmp_path, "  it: {at: {look: mast}, rate: 2, bump: {thing: spoon, impulse: 1 N*s}}\n")
    assert main(arguments(tmp_path, "make dumplings", faults)) == Exit.REJECTED
    message = capsys.readouterr()
    shown = message.out + message.err
    assert f"{faults}:3:32" in shown
    assert "`2` is outside its bounds" in shown
    assert not (tmp_path / "out").exists()


def test_a_plant_without_physics_has_no_faults(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = arguments(tmp_path, "make dumplings", "wrapper_bumped", "--plant", "symbolic")
    assert main(words) == Exit.REJECTED
    assert "`--faults` needs `--plant physics`" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
