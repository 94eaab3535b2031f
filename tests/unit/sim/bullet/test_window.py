"""Both ends of a window's connection in this process; test_window_process.py opens real processes."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator
from math import sqrt
from multiprocessing.connection import Connection
from typing import Any

import pytest

from aeros.sim.bullet import window as module
from aeros.sim.bullet.client import bullet
from aeros.sim.bullet.mirror import bodies_of, poses_of, shapes_of
from aeros.sim.bullet.window import ViewerWindow, WindowError, WindowUpdate, orbit_view, run_window
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.geometry import UPRIGHT, Camera, Pose
from aeros.sim.mujoco.world import MujocoWorld
from aeros.spec.diagnostics.errors import MisuseError

pytestmark = pytest.mark.physics

VIEW = Camera(eye=(1.0, 0.0, 1.0), target=(0.0, 0.0, 0.0))


class Peer:
    """In place of the window's process: the test speaks at its end of the connection."""

    def __init__(self, words: int) -> None:
        self.words = words
        self.end: Connection[Any, Any]
        self.joined: list[float | None] = []
        self.is_killed = False
        self.hangs = False

    def Pipe(self) -> tuple[Any, Any]:  # noqa: N802 - the name of multiprocessing's
        ours, its_end = multiprocessing.Pipe()
        # What the run closes is its copy of this end.
        self.end = multiprocessing.connection.Connection(os.dup(its_end.fileno()))
        return ours, its_end

    def Process(self, target: Any, args: Any, daemon: bool) -> Peer:  # noqa: N802
        assert target is run_window
        assert daemon
        self.opened = args[1]
        return self

    def start(self) -> None:
        for _ in range(self.words):
            self.end.send(None)

    def join(self, timeout: float | None = None) -> None:
        self.joined.append(timeout)

    def is_alive(self) -> bool:
        return self.hangs and not self.is_killed

    def kill(self) -> None:
        self.is_killed = True

    def updates(self) -> list[WindowUpdate]:
        found = []
        while self.end.poll(0.0):
            found.append(self.end.recv())
        return found


@pytest.fixture
def make_window(monkeypatch: pytest.MonkeyPatch) -> Callable[[Peer], ViewerWindow]:
    def make(peer: Peer) -> ViewerWindow:
        monkeypatch.setenv("DISPLAY", ":7")
        monkeypatch.setattr(module, "_OPEN_TIMEOUT_S", 0.01)
        monkeypatch.setattr(multiprocessing, "get_context", lambda method: {"spawn": peer}[method])
        return ViewerWindow()

    return make


@pytest.fixture
def world() -> Iterator[PhysicsWorld]:
    made = PhysicsWorld()
    yield made
    made.close()


Make = Callable[[Peer], ViewerWindow]


def test_an_update_is_sent_every_8_ticks_once_the_window_is_ready(
    make_window: Make, world: PhysicsWorld
) -> None:
    peer = Peer(1)
    window = make_window(peer)
    box = world.bodies.add_box((0.1, 0.1, 0.1), (0.4, 0.0, 0.2), mass=0.1)
    window.tick(world, VIEW)
    assert peer.updates() == []  # it is open and has not asked for one
    peer.end.send(None)
    for world.ticks in (1, 7, 9):
        window.tick(world, VIEW)
    assert peer.updates() == []
    world.ticks = 16
    window.tick(world, VIEW)
    ((camera, new, poses),) = peer.updates()
    assert camera == VIEW
    assert new == shapes_of(world, [box])
    assert poses == poses_of(world, new)
    window.tick(world, VIEW)
    assert peer.updates() == []
    window.close()


def test_only_what_is_new_is_sent_again(make_window: Make, world: PhysicsWorld) -> None:
    peer = Peer(2)
    window = make_window(peer)
    first = world.bodies.add_box((0.1, 0.1, 0.1), (0.4, 0.0, 0.2))
    window.tick(world, VIEW)
    second = world.bodies.add_box((0.1, 0.1, 0.1), (0.8, 0.0, 0.2))
    peer.end.send(None)
    window.tick(world, VIEW)
    peer.end.send(None)
    window.tick(world, VIEW)
    updates = peer.updates()
    assert [[shape.body for shape in one.new] for one in updates] == [[first], [second], []]
    assert [one.camera for one in updates] == [VIEW, None, None]
    assert [len(one.poses) for one in updates] == [1, 2, 2]
    window.close()


def test_a_window_that_is_gone_is_left_alone(make_window: Make, world: PhysicsWorld) -> None:
    peer = Peer(2)
    window = make_window(peer)
    peer.end.close()
    for _ in range(3):
        window.tick(world, VIEW)
    window.close()
    window.close()
    assert not peer.is_killed


def test_a_window_that_hangs_is_killed(make_window: Make) -> None:
    peer = Peer(1)
    peer.hangs = True
    window = make_window(peer)
    assert peer.joined == []
    window.close()
    assert peer.is_killed
    assert peer.joined == [1.0, None]


def test_a_window_that_does_not_open_in_time_is_an_error(make_window: Make) -> None:
    peer = Peer(0)
    with pytest.raises(WindowError, match="no window opens on display `:7`"):
        make_window(peer)
    assert peer.joined == [1.0]
    assert peer.opened is module.open_window


def test_an_empty_display_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DISPLAY", "")
    with pytest.raises(WindowError, match="there is no display"):
        ViewerWindow()


# The window's end.


def test_a_window_draws_each_update_and_ends_with_its_connection(
    monkeypatch: pytest.MonkeyPatch, world: PhysicsWorld
) -> None:
    ignored: list[Any] = []
    cameras: list[Any] = []
    switched: list[Any] = []
    monkeypatch.setattr(signal, "signal", lambda *what: ignored.append(what))
    monkeypatch.setattr(bullet, "resetDebugVisualizerCamera", lambda *view, **of: cameras.append(view))
    monkeypatch.setattr(bullet, "configureDebugVisualizer", lambda *flag, **of: switched.append(flag))
    world.bodies.add_box((0.1, 0.1, 0.1), (0.4, 0.0, 0.2))
    shapes = shapes_of(world, bodies_of(world))
    other = PhysicsWorld()
    ours, its_end = multiprocessing.Pipe()
    there = [Pose((x, 0.0, 0.0), UPRIGHT) for x in (1.0, 2.0)]
    ours.send(WindowUpdate(VIEW, shapes, [there[0]]))
    ours.send(WindowUpdate(None, [], [there[1]]))
    # It says that it is open, and then before each update that it can draw one.
    heard = []

    def opened() -> int:
        heard.append(ours.poll(0.0))
        return other.client

    read = its_end.recv

    class End:
        send = its_end.send

        def recv(self) -> Any:
            if not its_end.poll(0.0):
                raise EOFError
            return read()

    run_window(End(), opened)  # type: ignore[arg-type]
    assert heard == [False]
    count = 0
    while ours.poll(0.0):
        assert ours.recv() is None
        count += 1
    assert count == 4
    assert [other.pose(body).position for body in bodies_of(other)] == [(2.0, 0.0, 0.0)]
    assert cameras == [orbit_view(VIEW)]
    assert switched == [(bullet.COV_ENABLE_RENDERING, 0), (bullet.COV_ENABLE_RENDERING, 1)]
    assert ignored == [(signal.SIGINT, signal.SIG_IGN)]
    other.close()


def test_a_window_that_is_closed_by_hand_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(signal, "signal", lambda *what: None)
    other = PhysicsWorld()
    client = other.client
    other.close()
    ours, its_end = multiprocessing.Pipe()
    run_window(its_end, lambda: client)
    assert ours.recv() is None
    assert not ours.poll(0.0)


@pytest.mark.parametrize(
    ("eye", "yaw", "pitch"),
    [
        # PyBullet's camera at yaw 0 stands on -y and looks along y.
        ((0.0, -2.0, 0.0), 0.0, 0.0),
        ((2.0, 0.0, 0.0), 90.0, 0.0),
        ((-2.0, 0.0, 0.0), -90.0, 0.0),
        ((0.0, -sqrt(2.0), sqrt(2.0)), 0.0, -45.0),
        ((0.0, -sqrt(3.0), -1.0), 0.0, 30.0),
    ],
)
def test_a_camera_orbits_its_target(eye: tuple[float, float, float], yaw: float, pitch: float) -> None:
    target = (5.0, 6.0, 7.0)
    camera = Camera(eye=(eye[0] + 5.0, eye[1] + 6.0, eye[2] + 7.0), target=target)
    *view, looked_at = orbit_view(camera)
    assert view == pytest.approx([2.0, yaw, pitch])
    assert looked_at == target


def test_a_world_of_another_engine_is_refused() -> None:
    window = ViewerWindow.__new__(ViewerWindow)
    with pytest.raises(MisuseError, match="worlds of PyBullet alone"):
        window.tick(MujocoWorld(), Camera((1.0, 0.0, 1.0), (0.0, 0.0, 0.0)))
