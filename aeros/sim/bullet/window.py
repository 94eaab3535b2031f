"""Show a run in a PyBullet window, which is a process of its own and gets the poses of all shapes.

The run's world and the window's are separate: the mouse moves nothing in the run, and closing the window or
losing the display does not end the run. The window draws as fast as it can; the run never waits for it.
"""

from __future__ import annotations

import math
import multiprocessing
import os
import signal
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Final, NamedTuple

from aeros.sim.bullet.client import bullet
from aeros.sim.bullet.mirror import SceneMirror, Shape, bodies_of, poses_of, shapes_of
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.engine.world import EngineWorld
from aeros.sim.geometry import Camera, Pose, Vector3, subtract
from aeros.spec.diagnostics.errors import MisuseError

_OPEN_TIMEOUT_S: Final = 30.0  # s, for the window to open
_FRAME_TICKS: Final = 8  # ticks: 30 pictures for each simulated second at most


class WindowError(Exception):
    """The window cannot be opened; the message says why."""


class WindowUpdate(NamedTuple):
    """A message to the window.

    Attributes:
        camera: new position of the window's camera; None to leave it.
        new: shapes that have appeared since the last message.
        poses: poses in W of all shapes, in the order in which they appeared.
    """

    camera: Camera | None
    new: list[Shape]
    poses: list[Pose]


# Runs in the window's process.


def run_window(connection: Connection, opened: Callable[[], int]) -> None:
    """Draw updates until the window or the other end of `connection` is closed; runs in the window's process.

    It sends one object when the window is open, and one whenever it can draw the next update.

    Args:
        connection: brings `WindowUpdate`s.
        opened: opens the window and returns its PyBullet client.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the run handles Ctrl-C and closes the window
    client = opened()
    mirror = SceneMirror(client)
    connection.send(None)
    while bullet.isConnected(client):
        try:
            connection.send(None)
            update: WindowUpdate = connection.recv()
        except (EOFError, OSError):
            return
        if update.camera is not None:
            bullet.resetDebugVisualizerCamera(*orbit_view(update.camera), physicsClientId=client)
        if update.new:  # redraw once, not after each shape
            bullet.configureDebugVisualizer(bullet.COV_ENABLE_RENDERING, 0, physicsClientId=client)
        mirror.add(update.new)
        mirror.place(update.poses)
        if update.new:
            bullet.configureDebugVisualizer(bullet.COV_ENABLE_RENDERING, 1, physicsClientId=client)


def open_window() -> int:
    """Open a PyBullet window in which the mouse moves only the camera.

    PyBullet ends the process if it finds no X server, and prints to the terminal, so output is discarded.

    Returns:
        The number of the client.
    """
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)
    client: int = bullet.connect(bullet.GUI)
    for flag in (
        bullet.COV_ENABLE_GUI,
        bullet.COV_ENABLE_MOUSE_PICKING,
        bullet.COV_ENABLE_KEYBOARD_SHORTCUTS,
    ):
        bullet.configureDebugVisualizer(flag, 0, physicsClientId=client)
    return client


def orbit_view(camera: Camera) -> tuple[float, float, float, Vector3]:
    """Convert a camera to the form of PyBullet's window.

    Args:
        camera: in W.

    Returns:
        Distance, m; yaw, degrees; pitch, degrees; and the point looked at in W, m.
    """
    x, y, z = subtract(camera.eye, camera.target)
    distance = math.hypot(x, y, z)
    return distance, math.degrees(math.atan2(x, -y)), math.degrees(-math.asin(z / distance)), camera.target


# Runs in the run's process.


class ViewerWindow:
    """Viewer that shows a world in a window.

    Args:
        opened: opens the window, in the window's process.

    Raises:
        WindowError: there is no display, or no window opens on it within 30 s.
    """

    def __init__(self, opened: Callable[[], int] = open_window) -> None:
        display = os.environ.get("DISPLAY")
        if not display:
            raise WindowError("there is no display: DISPLAY is not set")
        context = multiprocessing.get_context("spawn")
        self._connection, its_end = context.Pipe()
        self._process = context.Process(target=run_window, args=(its_end, opened), daemon=True)
        self._process.start()
        its_end.close()
        self._shapes: list[Shape] = []
        self._known: set[int] = set()
        self._is_open = self._is_ready(_OPEN_TIMEOUT_S)
        if not self._is_open:
            self.close()
            raise WindowError(f"no window opens on display `{display}`, which needs an X server with OpenGL")

    def begin(self, parts: object) -> None:
        """Implement `Viewer.begin`: shapes are sent with the first update."""

    def tick(self, world: EngineWorld, view: Camera) -> None:
        """Send an update if one is due and the window has drawn the previous one.

        Args:
            world: the simulated world, of PyBullet.
            view: camera to begin with.

        Raises:
            MisuseError: the world is of another engine.
        """
        if not isinstance(world, PhysicsWorld):
            raise MisuseError("the window shows worlds of PyBullet alone")
        if world.ticks % _FRAME_TICKS or not self._is_open or not self._is_ready(0.0):
            return
        fresh = [body for body in bodies_of(world) if body not in self._known]
        new = shapes_of(world, fresh)
        camera = None if self._known else view
        self._known.update(fresh)
        self._shapes += new
        try:
            self._connection.send(WindowUpdate(camera, new, poses_of(world, self._shapes)))
        except OSError:
            self._is_open = False

    def close(self) -> None:
        """Close the window; safe to call twice."""
        self._is_open = False
        self._connection.close()
        self._process.join(1.0)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()

    def _is_ready(self, patience: float) -> bool:
        """Return True if the window has opened, or drawn the last update, within `patience` s."""
        try:
            if not self._connection.poll(patience):
                return False
            self._connection.recv()
        except (EOFError, OSError):
            self._is_open = False
            return False
        return True
