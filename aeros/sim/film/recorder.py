"""Record the poses of a physics plant, 30 times per simulated second, for a film that is made afterwards."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from os import SEEK_END
from pathlib import Path
from typing import BinaryIO, Final, NamedTuple

import numpy as np

from aeros.files import open_private
from aeros.runtime.ports import PersonFigure
from aeros.sim.clock import TICK
from aeros.sim.engine.engine import PlacedBody
from aeros.sim.engine.world import EngineWorld
from aeros.sim.film.recording import (
    PICTURES_PER_SECOND,
    Actor,
    CoatingFigure,
    PoseSample,
    RobotFigure,
    Stage,
    encode_sample,
    encode_stage,
)
from aeros.sim.geometry import Camera, Pose, Vector3
from aeros.sim.layouts.coating import CoatingMap
from aeros.sim.physics import PlantParts
from aeros.sim.pictures.urdf_model import UrdfVisuals, roll_pitch_yaw
from aeros.sim.pictures.visual_shapes import VisualShape, shapes_of
from aeros.sim.robot.robot import CARRIAGE_EDGES
from aeros.spec.model.scene import UrdfModel

_TICKS: Final = round(1.0 / (PICTURES_PER_SECOND * TICK))
"""Ticks between two pictures."""

_DIGITS: Final = 4
"""Decimals of what is written: 0.1 mm and 0.1 mrad."""


class PlacedActor(NamedTuple):
    """An actor, and how to find its pose.

    Attributes:
        actor: the shapes.
        body: number of its body in the world.
        link: number of its link; -1 for the base.
        joint: number of the joint that decides if it is shown; None if it always is.
        range: least and greatest position of that joint in which it is shown, rad or m.
        is_fixed: True if it never moves.
    """

    actor: Actor
    body: int
    link: int
    joint: int | None = None
    range: tuple[float, float] = (0.0, 0.0)
    is_fixed: bool = False


class PoseRecorder:
    """Viewer that writes a recording. Disk errors are counted: no robot stops for a film.

    Args:
        path: the file; lines are appended.

    Attributes:
        lost: number of lines that could not be written.

    Raises:
        OSError: the file cannot be opened.
    """

    def __init__(self, path: Path) -> None:
        self.lost = 0
        self._file: BinaryIO = open_private(path)
        self._parts: PlantParts | None = None
        self._actors: tuple[PlacedActor, ...] = ()
        self._stage: str | None = None
        self._before: PoseSample | None = None
        self._wiped: dict[str, tuple[int, str]] = {}
        self._first_cameras: dict[str, Camera] = {}

    def begin(self, parts: PlantParts) -> None:
        """Implement `Viewer.begin`: write the shapes."""
        self._parts = parts
        bodies = parts.scene.placed_bodies()
        self._actors = tuple(one for placed in bodies.values() for one in _actors_of(placed))
        scene = parts.scene
        self._first_cameras = self._cameras()
        stage = Stage(
            scene.view,
            _robot_figure(parts),
            tuple(one.actor for one in self._actors),
            {name: _coating_figure(one) for name, one in scene.coatings().items()},
            self._first_cameras,
        )
        self._stage, self._before = encode_stage(stage), None
        self._record(parts.world)

    def tick(self, world: EngineWorld, view: Camera) -> None:
        """Implement `Viewer.tick`: write the poses if a picture is due."""
        if world.ticks % _TICKS == 0:
            self._record(world)

    def close(self) -> None:
        """Implement `Viewer.close`: complete the file."""
        try:
            self._file.close()
        except OSError:
            self.lost += 1

    def _record(self, world: EngineWorld) -> None:
        assert self._parts is not None  # noqa: S101  for the type checker
        if self._stage is not None:
            # Pictures without their shapes would be read as those of the start before.
            if not self._write("" if self._is_at_start_of_line() else "\n") or not self._write(self._stage):
                return
            self._stage = None
        robot = self._parts.robot
        state, (base, _) = robot.read_sensors(), robot.true_points()
        command, _ = robot.tool_command()
        before = self._before
        sample = PoseSample(
            round(world.time, _DIGITS),
            tuple(round(one, _DIGITS) for one in state.q),
            _rounded(base),
            round(state.finger_gap, _DIGITS),
            _rounded(np.add(command, base).tolist()),
            {
                number: _pose(world, one) if before is None or not one.is_fixed else before.poses[number]
                for number, one in enumerate(self._actors)
            },
            tuple(
                PersonFigure(*(round(part, _DIGITS) for part in one)) for one in self._parts.people.figures()
            ),
            {name: self._cells(name, one) for name, one in self._parts.scene.coatings().items()},
            {
                name: one
                for name, one in self._cameras().items()
                if one != self._first_cameras[name] or (before is not None and name in before.cameras)
            },
        )
        # After a line that is lost, the next is whole.
        self._before = sample if self._write(encode_sample(sample, before)) else None

    def _cameras(self) -> dict[str, Camera]:
        """Return where the robot's cameras are; those on the hand and the carriage move with it."""
        assert self._parts is not None  # noqa: S101  for the type checker
        scene = self._parts.scene
        return {name: _rounded_camera(scene.camera(name)) for name in scene.cameras}

    def _cells(self, name: str, coating: CoatingMap) -> str:
        """Return which cells of a layer are still there; cells never become coated again."""
        count = int(np.count_nonzero(coating.wiped))
        known = self._wiped.get(name)
        if known is None or known[0] != count:
            cells = np.where(coating.wiped, "0", "1").ravel().tolist()
            known = self._wiped[name] = (count, "".join(cells))
        return known[1]

    def _is_at_start_of_line(self) -> bool:
        """Return whether the last line is complete: a start that was killed may have left half of one."""
        try:
            if self._file.seek(0, SEEK_END) == 0:
                return True
            self._file.seek(-1, SEEK_END)
            return self._file.read(1) == b"\n"
        except OSError:
            return True

    def _write(self, line: str) -> bool:
        """Append a line; return False, and count it, if it could not be written whole."""
        content = line.encode()
        written = 0
        try:
            written = self._file.write(content) or 0
            if written == len(content):
                return True
            self._file.truncate(self._file.seek(0, SEEK_END) - written)
        except OSError:
            pass
        self.lost += 1
        return False


def _pose(world: EngineWorld, one: PlacedActor) -> Pose | None:
    low, high = one.range
    if one.joint is not None and not low <= world.joint_position(one.body, one.joint) <= high:
        return None
    pose = world.frame_pose(one.body) if one.link < 0 else world.pose(one.body, one.link)
    x, y, z, w = pose.orientation
    return Pose(
        _rounded(pose.position), (round(x, _DIGITS), round(y, _DIGITS), round(z, _DIGITS), round(w, _DIGITS))
    )


def _rounded(point: Vector3) -> Vector3:
    x, y, z = point
    return (round(x, _DIGITS), round(y, _DIGITS), round(z, _DIGITS))


def _actors_of(placed: PlacedBody) -> Iterator[PlacedActor]:
    body = placed.body
    if body.look:
        yield from _actors_of_look(placed)
        return
    if not isinstance(body.shape, UrdfModel):
        actor = Actor(body.name, "", tuple(shapes_of(body.shape, body.colour)))
        yield PlacedActor(actor, placed.number, -1, is_fixed=not body.is_movable)
        return
    by_link: dict[str, list[VisualShape]] = {}
    for link, shape in UrdfVisuals(body.shape.path).shapes:
        by_link.setdefault(link, []).append(shape)
    for link, shapes in by_link.items():
        number = placed.links[link]
        is_fixed = number < 0 and not body.is_movable
        yield PlacedActor(Actor(body.name, link, tuple(shapes)), placed.number, number, is_fixed=is_fixed)


def _actors_of_look(placed: PlacedBody) -> Iterator[PlacedActor]:
    """Yield the parts of a look, those together that move and appear together."""
    groups: dict[tuple[str | None, str | None, tuple[float, float]], list[VisualShape]] = {}
    for part in placed.body.look:
        place = Pose(part.position, roll_pitch_yaw(*part.tilt))
        shape = VisualShape(part.kind, part.size, part.colour, place, part.opacity)
        groups.setdefault((part.link, part.joint, part.range), []).append(shape)
    for (link, joint, shown), shapes in groups.items():
        actor = Actor(placed.body.name, link or "", tuple(shapes))
        number = -1 if link is None else placed.links[link]
        condition = None if joint is None else placed.joints[joint]
        is_fixed = number < 0 and condition is None and not placed.body.is_movable
        yield PlacedActor(actor, placed.number, number, condition, shown, is_fixed)


def _rounded_camera(camera: Camera) -> Camera:
    return replace(camera, eye=_rounded(camera.eye), target=_rounded(camera.target), up=_rounded(camera.up))


def _robot_figure(parts: PlantParts) -> RobotFigure:
    model = parts.robot.model
    return RobotFigure(
        model.name,
        tuple(model.body.dh_rows),
        tuple((hull.link, hull.joint, tuple(hull.corners)) for hull in model.body.hulls),
        model.hand.flange,
        model.hand.turn,
        model.hand.tool,
        CARRIAGE_EDGES if parts.scene.robot.carriage else None,
        "" if model.stock_urdf is None else model.stock_urdf.path,
        () if model.stock_urdf is None else tuple(model.stock_urdf.joints),
    )


def _coating_figure(one: CoatingMap) -> CoatingFigure:
    declared = one.coating
    return CoatingFigure(declared.low, declared.high, declared.cell, declared.colour)
