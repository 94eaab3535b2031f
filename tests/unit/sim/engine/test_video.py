"""A film holds what was seen, in the format of its name, and is whole or not there."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from aeros.cli.arguments import VIDEO_SUFFIXES
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.engine import video
from aeros.sim.engine.video import FRAMES_MAX, VideoError, VideoRecorder
from aeros.sim.physics import make_plant
from aeros.sim.scenes.physics_scene import PhysicsScene
from aeros.skill import act
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.acting import allow, execute
from tests.unit.sim.films import frames_of

pytestmark = pytest.mark.physics

VIEW = PhysicsScene(shipped_scene("bare")).view


@pytest.mark.parametrize("suffix", VIDEO_SUFFIXES)
def test_a_video_shows_the_motion(suffix: str, tmp_path: Path) -> None:
    film = tmp_path / "made" / f"film{suffix}"
    plant = make_plant(shipped_scene("bare"), 0, spectators=[VideoRecorder(film)])
    execute(plant, act("move_tool", target=(0.5, 0.2, 0.3), yaw=0.0, speed=0.2), allow, 1e9)
    expected = int(plant.now() / 0.75) + 1
    plant.close()
    plant.close()
    frames = frames_of(film)
    assert len(frames) == expected > 2
    assert {one.shape for one in frames} == {(VIEW.height, VIEW.width, 3)}
    moved = np.abs(frames[0].astype(int) - frames[-1].astype(int)).max(axis=2) > 60
    assert 0.01 < moved.mean() < 0.5
    assert list(film.parent.iterdir()) == [film]


@pytest.mark.parametrize("suffix", VIDEO_SUFFIXES)
def test_a_video_shows_the_rendered_pictures(suffix: str, tmp_path: Path) -> None:
    film = tmp_path / f"film{suffix}"
    world = PhysicsWorld()
    world.bodies.add_box((1.0, 1.0, 0.1), (0.5, 0.0, 0.0), colour=(0.8, 0.2, 0.1, 1.0))
    recorder = VideoRecorder(film)
    recorder.tick(world, VIEW)
    recorder.close()
    seen = world.renderer.render(VIEW).rgb
    world.close()
    (frame,) = frames_of(film)
    assert np.abs(frame.astype(int) - seen.astype(int)).mean() < 6.0


def test_a_long_run_has_no_more_pictures_than_a_short_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    most = 12
    assert most < FRAMES_MAX
    monkeypatch.setattr(video, "FRAMES_MAX", most)
    world = PhysicsWorld()
    recorder = VideoRecorder(tmp_path / "film.mp4")
    for second in range(3 * most):
        world.ticks = second * 240
        world.bodies.add_box((0.1, 0.1, 0.1), (0.01 * second, 0.0, 0.0))
        recorder.tick(world, VIEW)
    recorder.close()
    world.close()
    assert most / 2 < len(frames_of(tmp_path / "film.mp4")) <= most


def test_without_a_picture_no_video_is_written(tmp_path: Path) -> None:
    VideoRecorder(tmp_path / "film.gif").close()
    assert list(tmp_path.iterdir()) == []


def test_an_existing_video_is_not_overwritten(tmp_path: Path) -> None:
    film = tmp_path / "film.gif"
    film.write_bytes(b"mine")
    with pytest.raises(VideoError, match="exists already"):
        VideoRecorder(film)
    assert film.read_bytes() == b"mine"


def test_a_video_below_a_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(VideoError, match=r"cannot write video `.*file/film.gif`: "):
        VideoRecorder(tmp_path / "file" / "film.gif")


def test_a_video_in_an_unwritable_folder_is_refused() -> None:
    with pytest.raises(VideoError, match=r"cannot write video `/proc/film\.gif`: "):
        VideoRecorder(Path("/proc/film.gif"))


def test_without_pyav_there_is_no_mp4_and_the_cure_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delitem(sys.modules, "aeros.sim.engine.mp4", raising=False)
    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(VideoError, match=r"needs `pip install 'aeros\[video\]'` \(av is missing\)"):
        VideoRecorder(tmp_path / "film.mp4")


def test_a_video_that_cannot_be_written_completely_is_not_left_behind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(path: Path, content: bytes) -> None:
        path.with_name(path.name + ".new").write_bytes(content[: len(content) // 2])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(video, "replace_durably", interrupted)
    world, recorder = PhysicsWorld(), VideoRecorder(tmp_path / "film.gif")
    recorder.tick(world, VIEW)
    with pytest.raises(OSError, match="No space left"):
        recorder.close()
    world.close()
    assert not (tmp_path / "film.gif").exists()
