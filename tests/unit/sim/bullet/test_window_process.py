"""A window shows the run's world, and nothing that happens to it happens to the run."""

from __future__ import annotations

import multiprocessing.util
import os
import signal
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from aeros.sim.bullet.client import bullet
from aeros.sim.bullet.window import ViewerWindow, WindowError, orbit_view
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.geometry import Camera
from aeros.sim.scenes.physics_scene import PhysicsScene
from tests.shipped_scenes import SHIPPED, shipped_scene

pytestmark = pytest.mark.physics

VIEW = Camera(eye=(1.15, 0.55, 0.62), target=(0.42, 0.03, 0.1), field_of_view=40.0)


@pytest.mark.parametrize("name", SHIPPED)
def test_the_window_uses_the_camera_of_videos(name: str) -> None:
    camera = PhysicsScene(shipped_scene(name)).view
    distance, yaw, pitch, target = orbit_view(camera)
    by_window = bullet.computeViewMatrixFromYawPitchRoll(target, distance, yaw, pitch, 0.0, 2)
    assert by_window == pytest.approx(
        bullet.computeViewMatrix(camera.eye, camera.target, camera.up), abs=1e-5
    )


def test_without_a_display_there_is_no_window(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    with pytest.raises(WindowError, match="there is no display: DISPLAY is not set"):
        ViewerWindow()


def test_a_display_without_a_server_is_refused_and_ends_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DISPLAY", ":9471")
    with pytest.raises(WindowError, match="no window opens on display `:9471`"):
        ViewerWindow()


def unseen() -> int:
    """In place of a window: what it shows at its end is left as a picture."""
    world = PhysicsWorld()

    def leave() -> None:
        Image.fromarray(world.renderer.render(VIEW).rgb).save(os.environ["SHOWN"])

    multiprocessing.util.Finalize(None, leave, exitpriority=1)
    return world.client


def unwatched(monkeypatch: pytest.MonkeyPatch, shown: Path) -> ViewerWindow:
    monkeypatch.setenv("DISPLAY", "none")
    monkeypatch.setenv("SHOWN", str(shown))
    return ViewerWindow(unseen)


def test_a_window_shows_the_scene_and_people_who_come_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    window = unwatched(monkeypatch, tmp_path / "shown.png")
    world = PhysicsWorld()
    world.bodies.add_box((0.6, 0.6, 0.1), (0.4, 0.0, -0.05))
    cube = world.bodies.add_box((0.1, 0.1, 0.1), (0.4, 0.0, 0.2), mass=0.1, colour=(0.1, 0.3, 0.8, 1.0))
    late = time.monotonic() + 20.0
    while world.ticks < 2400 and time.monotonic() < late:
        world.step()
        if world.ticks == 1200:
            world.bodies.add_box((0.1, 0.1, 0.1), (0.2, 0.1, 0.05), colour=(0.8, 0.1, 0.1, 1.0))
        window.tick(world, VIEW)
        time.sleep(0.001)
    assert world.pose(cube).position[2] == pytest.approx(0.05, abs=0.002)
    window.close()
    window.close()
    with Image.open(tmp_path / "shown.png") as shown:
        assert np.abs(np.asarray(shown).astype(int) - world.renderer.render(VIEW).rgb).mean() < 0.5
    world.close()


def test_a_window_that_is_closed_ends_no_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    window, world = unwatched(monkeypatch, tmp_path / "shown.png"), PhysicsWorld()
    world.bodies.add_box((0.1, 0.1, 0.1), (0.4, 0.0, 0.2))
    (process,) = multiprocessing.active_children()
    assert process.pid is not None
    os.kill(process.pid, signal.SIGKILL)
    process.join()
    for _ in range(100):
        world.step()
        window.tick(world, VIEW)
    window.close()
    world.close()
    assert multiprocessing.active_children() == []
