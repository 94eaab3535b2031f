"""The recorder writes 30 pictures a second of what moves, from a world that it only reads."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import pytest

from aeros.sim.film.recorder import PoseRecorder
from aeros.sim.film.recording import read_recording
from aeros.sim.physics import make_mujoco_engine, make_plant
from aeros.skill import act
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.acting import allow, execute

pytest.importorskip("mujoco")


def test_a_plant_is_recorded_with_its_looks_and_its_layers(tmp_path: Path) -> None:
    path = tmp_path / "poses.jsonl"
    scene = shipped_scene("table")
    plant = make_plant(scene, 0, engine=make_mujoco_engine(), spectators=[PoseRecorder(path)])
    execute(plant, act("wait", duration=0.2), allow, 1e9)
    ended, truth = plant.now(), plant.observe()["joint_position"].value
    plant.close()
    plant.close()
    read = read_recording(path)
    times = [sample.time for sample in read.samples]
    assert times == pytest.approx([number / 30 for number in range(int(ended * 30 + 1e-6) + 1)], abs=1e-4)
    assert read.samples[-1].joints == pytest.approx(truth, abs=2e-3)
    assert {one.body for one in read.stage.actors} == scene.bodies.keys()
    looks = sum(len(one.shapes) for one in read.stage.actors if one.body == "sponge")
    assert looks == len(scene.bodies["sponge"].look) > 3
    assert read.stage.cameras.keys() == scene.cameras.keys()
    assert set(read.samples[0].coated["dirt"]) == {"1"}
    assert read.stage.robot.carriage is not None
    # A world at rest costs a line of some 30 bytes a picture.
    assert len(path.read_bytes().splitlines()[-1]) < 200


def test_the_camera_on_the_hand_is_recorded_where_it_moves(tmp_path: Path) -> None:
    recorder = PoseRecorder(tmp_path / "poses.jsonl")
    plant = make_plant(shipped_scene("fetch"), 0, engine=make_mujoco_engine(), spectators=[recorder])
    parts = recorder._parts
    assert parts is not None
    x, y, z = plant.observe()["tool_position"].value
    execute(plant, act("move_tool", target=(x, y + 0.1, z), yaw=0.0, speed=0.4), allow, 1e9)
    seen = parts.scene.camera("hand")
    execute(plant, act("wait", duration=0.1), allow, 1e9)
    plant.close()
    read = read_recording(tmp_path / "poses.jsonl")
    first, last = read.stage.cameras["hand"], read.samples[-1].cameras["hand"]
    assert last.eye == pytest.approx(seen.eye, abs=2e-3)
    assert last.target == pytest.approx(seen.target, abs=2e-3)
    assert last.eye[1] - first.eye[1] == pytest.approx(0.1, abs=5e-3)
    assert (last.width, last.field_of_view) == (first.width, first.field_of_view)
    assert "overhead" not in read.samples[-1].cameras


def test_a_full_disk_stops_no_robot(tmp_path: Path) -> None:
    recorder = PoseRecorder(tmp_path / "poses.jsonl")

    class FullDisk:
        def write(self, _: bytes) -> int:
            raise OSError(28, "No space left on device")

        def seek(self, *_: int) -> int:
            raise OSError(5, "Input/output error")

        def close(self) -> None:
            raise OSError(28, "No space left on device")

    recorder.close()
    recorder._file = FullDisk()  # type: ignore[assignment]
    plant = make_plant(shipped_scene("bare"), 0, engine=make_mujoco_engine(), spectators=[recorder])
    execute(plant, act("wait", duration=0.1), allow, 1e9)
    plant.close()
    assert recorder.lost >= 4


def test_a_recording_is_read_though_lines_of_it_are_lost(tmp_path: Path) -> None:
    path = tmp_path / "poses.jsonl"
    # A start that was killed left half a line.
    path.write_text('{"schema":"aeros/po')
    recorder = PoseRecorder(path)
    file, lines = recorder._file, 0

    class NearlyFullDisk:
        """Loses the shapes once, and of the lines after the sixth one whole and one half."""

        def write(self, content: bytes) -> int:
            nonlocal lines
            lines += 1
            if lines in (2, 7):
                raise OSError(28, "No space left on device")
            return file.write(content[: len(content) // 2] if lines == 8 else content)

        def __getattr__(self, name: str) -> object:
            return getattr(file, name)

    recorder._file = NearlyFullDisk()  # type: ignore[assignment]
    plant = make_plant(shipped_scene("bare"), 0, engine=make_mujoco_engine(), spectators=[recorder])
    execute(plant, act("wait", duration=0.5), allow, 1e9)
    plant.close()
    assert recorder.lost == 3
    read = read_recording(path)
    assert read.samples[0].time == pytest.approx(1 / 30, abs=1e-4)
    times = [sample.time for sample in read.samples]
    gaps = [after - before for before, after in pairwise(times)]
    assert max(gaps) == pytest.approx(3 / 30, abs=2e-4)
    whole = [line for line in path.read_text().splitlines() if '"q"' in line and '"base"' in line]
    assert len(whole) >= 2
