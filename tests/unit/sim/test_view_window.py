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
from aeros.sim.bullet.mirror import SceneMirror, bodies_of, poses_of, shapes_of
from aeros.sim.bullet.panda import Panda
from aeros.sim.bullet.people import People, Person, Waypoint
from aeros.sim.bullet.window import ViewerWindow, WindowError, orbit_view
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.geometry import Camera
from aeros.sim.randomness import RandomSource
from aeros.sim.scenes import SCENES

pytestmark = pytest.mark.physics

VIEW = Camera(eye=(1.15, 0.55, 0.62), target=(0.42, 0.03, 0.1), field_of_view=40.0)

OFF_CENTRE = """<robot name="club"><link name="club">
<inertial><origin xyz="0.1 0 0.05" rpy="0 0.4 0"/><mass value="1"/>
<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>
<visual><origin xyz="0.02 0.1 0"/><geometry><sphere radius="0.07"/></geometry></visual></link></robot>"""


@pytest.mark.parametrize("name", sorted(SCENES))
def test_a_mirrored_scene_looks_the_same_to_the_pixel(name: str) -> None:
    scene, world, other = SCENES[name](), PhysicsWorld(), PhysicsWorld()
    robot = Panda(world, scene.robot)
    scene.build(world, robot, RandomSource(0))
    People(world, robot.body, [Person("guest", (Waypoint((0.5, 0.45)),))], RandomSource(0))
    mirror = SceneMirror(other.client)
    for body in bodies_of(world):
        if not shapes_of(world, [body]):  # what is painted on it is not mirrored
            bullet.removeBody(body, physicsClientId=world.client)
    shapes = shapes_of(world, bodies_of(world))
    mirror.add(shapes)
    for _ in range(2):
        for _ in range(120):
            world.step()
        mirror.place(poses_of(world, shapes))
        seen = world.renderer.render(scene.view).rgb
        assert len(np.unique(seen)) > 30
        assert np.array_equal(seen, other.renderer.render(scene.view).rgb)
    world.close()
    other.close()


def test_parts_are_where_they_are_on_a_body_that_is_heavier_at_one_end(tmp_path: Path) -> None:
    (tmp_path / "club.urdf").write_text(OFF_CENTRE)
    world, other = PhysicsWorld(), PhysicsWorld()
    world.bodies.add_urdf(str(tmp_path / "club.urdf"), (0.4, 0.0, 0.2), (0.0, 0.0, 0.6, 0.8))
    mirror = SceneMirror(other.client)
    shapes = shapes_of(world, bodies_of(world))
    mirror.add(shapes)
    mirror.place(poses_of(world, shapes))
    seen = world.renderer.render(VIEW).rgb
    assert len(np.unique(seen)) > 10
    assert np.array_equal(seen, other.renderer.render(VIEW).rgb)
    world.close()
    other.close()


@pytest.mark.parametrize("name", sorted(SCENES))
def test_the_window_uses_the_camera_of_videos(name: str) -> None:
    camera = SCENES[name]().view
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
