"""The recording of a run from which films are made: shapes once, then poses at each picture.

The file `poses.jsonl` has a line of JSON with the shapes, and a line for each picture. A line has only what
differs from the line before it; its last line may be cut off if the run was killed. SI units; frame W;
quaternions are x, y, z, w.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import ceil, hypot
from pathlib import Path
from typing import Any, Final

from aeros.files import open_regular
from aeros.kinematic_chain import PRISMATIC, Row
from aeros.runtime.ports import PersonFigure
from aeros.sim.geometry import Camera, Pose, Vector3, camera_axes
from aeros.sim.pictures.visual_shapes import SHAPE_KINDS, VisualShape
from aeros.spec.migrations.format import FormatVersionError
from aeros.spec.migrations.formats import POSES

PICTURES_PER_SECOND: Final = 30
"""Recorded pictures per second of simulated time."""

_GREATEST: Final = 1e4
"""Greatest magnitude of a number in a recording but for its time: m or rad."""

_LATEST: Final = 1e7
"""Greatest time in a recording, s: some 115 days."""

_MOST_CELLS: Final = 100_000
"""Greatest number of cells of a layer that a film can draw."""

_UNIT_WITHIN: Final = 0.01
"""Greatest difference of the length of a quaternion from 1; it is written with four decimals."""


_START: Final = b'{"schema":'
"""What the first line of each start begins with."""

_DAMAGE: Final = (
    ArithmeticError,
    AttributeError,
    LookupError,
    RecursionError,
    TypeError,
    ValueError,
)
"""What reading a line that is none of a recording raises."""


class RecordingError(Exception):
    """A recording that cannot be read; the message says why and what to do."""


@dataclass(frozen=True)
class Actor:
    """Shapes that move together.

    Attributes:
        body: name of the body.
        link: name of its link; empty if it has only one.
        shapes: the shapes, in the frame of the link.
    """

    body: str
    link: str
    shapes: tuple[VisualShape, ...]


@dataclass(frozen=True)
class RobotFigure:
    """The robot, as far as a picture shows it.

    Attributes:
        name: name of the robot.
        rows: modified Denavit-Hartenberg parameters of each joint.
        hulls: of each link its name, number of the joint that moves it, and corners in that joint's frame, m.
        flange: distance of the hand from the last joint's frame, m.
        turn: angle by which the hand is mounted turned, rad.
        tool: distance of the tool centre point from the hand's frame, m.
        carriage: edges of the carriage that it drives on, m; None if it stands fixed.
        urdf: path in PyBullet's data of a URDF with its meshes; empty if there is none.
        urdf_joints: names of the arm's joints in it, from the base outwards.
    """

    name: str
    rows: tuple[Row, ...]
    hulls: tuple[tuple[str, int, tuple[Vector3, ...]], ...]
    flange: float
    turn: float
    tool: float
    carriage: Vector3 | None
    urdf: str
    urdf_joints: tuple[str, ...]


@dataclass(frozen=True)
class CoatingFigure:
    """A layer on a rectangle at z = 0 of W, in square cells.

    Attributes:
        low: corner with the least x and y, m.
        high: corner with the greatest x and y, m.
        cell: edge of a cell, m.
        colour: red, green and blue in [0, 1].
    """

    low: tuple[float, float]
    high: tuple[float, float]
    cell: float
    colour: Vector3


@dataclass(frozen=True)
class Stage:
    """All that is the same in each picture of a run.

    Attributes:
        view: camera that the scene declares.
        robot: the robot.
        actors: shapes of the bodies.
        coatings: layers that are wiped off, by name.
        cameras: the robot's cameras as they are at the start, by name.
    """

    view: Camera
    robot: RobotFigure
    actors: tuple[Actor, ...]
    coatings: Mapping[str, CoatingFigure] = field(default_factory=dict)
    cameras: Mapping[str, Camera] = field(default_factory=dict)


@dataclass(frozen=True)
class PoseSample:
    """The state of a run at one picture.

    Attributes:
        time: simulated time, s.
        joints: joint positions, rad.
        base: position of the arm's base, m.
        gap: distance between the finger pads, m.
        command: position that the tool centre point is commanded to, m.
        poses: pose of each actor by its number; None of one that is not visible.
        people: the people.
        coated: of each layer a character for each cell, `1` if the layer is still there, row by row from the
            least y, by name.
        cameras: the robot's cameras that are not where they were at the start, by name.
    """

    time: float
    joints: tuple[float, ...] = ()
    base: Vector3 = (0.0, 0.0, 0.0)
    gap: float = 0.0
    command: Vector3 = (0.0, 0.0, 0.0)
    poses: Mapping[int, Pose | None] = field(default_factory=dict)
    people: tuple[PersonFigure, ...] = ()
    coated: Mapping[str, str] = field(default_factory=dict)
    cameras: Mapping[str, Camera] = field(default_factory=dict)


@dataclass(frozen=True)
class Recording:
    """A run as people can see it.

    Attributes:
        stage: what is the same in each picture.
        samples: the pictures, in the order of their time; at least one.
    """

    stage: Stage
    samples: Sequence[PoseSample]


# Writing.


def encode_stage(stage: Stage) -> str:
    """Encode the first line of a recording.

    Args:
        stage: what is the same in each picture.

    Returns:
        The line.
    """
    robot = stage.robot
    return _line(
        {
            "schema": POSES.schema,
            "view": _camera_to_json(stage.view),
            "robot": {
                "name": robot.name,
                "rows": robot.rows,
                "hulls": robot.hulls,
                "hand": [robot.flange, robot.turn, robot.tool],
                "carriage": robot.carriage,
                "urdf": robot.urdf,
                "urdf_joints": robot.urdf_joints,
            },
            "actors": [
                {"body": one.body, "link": one.link, "shapes": [_shape_to_json(part) for part in one.shapes]}
                for one in stage.actors
            ],
            "coatings": {
                name: {"low": one.low, "high": one.high, "cell": one.cell, "colour": one.colour}
                for name, one in stage.coatings.items()
            },
            "cameras": {name: _camera_to_json(one) for name, one in stage.cameras.items()},
        }
    )


def encode_sample(sample: PoseSample, before: PoseSample | None) -> str:
    """Encode a picture.

    Args:
        sample: the picture, its numbers rounded as they are to be written.
        before: the picture before it; None for the first.

    Returns:
        The line, without what is as before.
    """
    line: dict[str, Any] = {"t": sample.time}
    plain = {"q": "joints", "base": "base", "gap": "gap", "command": "command", "people": "people"}
    for key, name in plain.items():
        value = getattr(sample, name)
        if before is None or value != getattr(before, name):
            line[key] = value
    known = {} if before is None else before.poses
    moved = {
        str(number): None if pose is None else (*pose.position, *pose.orientation)
        for number, pose in sample.poses.items()
        if number not in known or known[number] != pose
    }
    coated = {
        name: cells
        for name, cells in sample.coated.items()
        if before is None or before.coated.get(name) != cells
    }
    seen_from = {
        name: (*one.eye, *one.target, *one.up)
        for name, one in sample.cameras.items()
        if before is None or before.cameras.get(name) != one
    }
    parts = (("move", moved), ("coated", coated), ("cameras", seen_from))
    line |= {key: value for key, value in parts if value}
    return _line(line)


def _line(content: Mapping[str, Any]) -> str:
    return json.dumps(content, separators=(",", ":")) + "\n"


def _camera_to_json(camera: Camera) -> dict[str, Any]:
    return {
        "eye": camera.eye,
        "target": camera.target,
        "up": camera.up,
        "field_of_view": camera.field_of_view,
        "size": [camera.width, camera.height],
    }


def _shape_to_json(shape: VisualShape) -> list[Any]:
    return [
        shape.kind,
        shape.size,
        shape.colour,
        shape.opacity,
        (*shape.place.position, *shape.place.orientation),
    ]


# Reading.


def read_recording(path: Path) -> Recording:
    """Read the recording of a run.

    If the plant was started more than once, it is that of the last start.

    Args:
        path: the file.

    Returns:
        The recording.

    Raises:
        RecordingError: the file is missing, damaged or of another version, or has no picture.
    """
    try:
        with open_regular(path) as file:
            lines = file.read().split(b"\n")
    except OSError as failure:
        raise RecordingError(f"`{path}` cannot be read: {failure.strerror}") from failure
    # A line that a killed run did not finish has no end; after the last complete one there is an empty text.
    stage: Stage | None = None
    samples: list[PoseSample] = []
    starts = [index for index, line in enumerate(lines[:-1]) if line.startswith(_START)]
    begin = starts[-1] if starts else 0
    for number, line in enumerate(lines[begin:-1], start=begin + 1):
        try:
            content = json.loads(line)
            if "schema" in content:
                POSES.require_current(content, path)
                stage, samples = _stage(content), []
            else:
                samples.append(_sample(content, samples[-1] if samples else PoseSample(0.0), stage))
        except FormatVersionError as failure:
            raise RecordingError(str(failure)) from failure
        except _DAMAGE as failure:
            raise RecordingError(
                f"`{path}`, line {number}: no line of a recording ({type(failure).__name__}: {failure}); "
                "run the task again to record it anew"
            ) from failure
    if stage is None or not samples:
        raise RecordingError(f"`{path}` has no picture: the run ended before its clock started")
    return Recording(stage, samples)


def _stage(content: Mapping[str, Any]) -> Stage:
    robot = content["robot"]
    flange, turn, tool = _numbers(robot["hand"], 3)
    return Stage(
        _camera(content["view"]),
        RobotFigure(
            _text(robot["name"]),
            tuple(_row(row) for row in robot["rows"]),
            tuple(_hull(one, len(robot["rows"])) for one in robot["hulls"]),
            flange,
            turn,
            tool,
            None if robot["carriage"] is None else _vector(robot["carriage"], 0.0),
            _urdf(robot["urdf"]),
            tuple(map(_text, robot["urdf_joints"])),
        ),
        tuple(
            Actor(_text(one["body"]), _text(one["link"]), tuple(_shape(part) for part in one["shapes"]))
            for one in content["actors"]
        ),
        {_text(name): _coating(one) for name, one in content["coatings"].items()},
        {_text(name): _camera(one) for name, one in content["cameras"].items()},
    )


def _hull(content: Sequence[Any], joints: int) -> tuple[str, int, tuple[Vector3, ...]]:
    link, joint, corners = content
    if type(joint) is not int or not 0 <= joint <= joints:
        raise ValueError(f"hull of `{link}`: `{joint}` is no joint from 0 to {joints}")
    if not corners:
        raise ValueError(f"hull of `{link}`: it has no corners")
    return _text(link), joint, tuple(map(_vector, corners))


def _urdf(content: Any) -> str:
    path = _text(content)
    if path and not path.endswith(".urdf"):
        raise ValueError(f"`{path}` is no URDF file")
    return path


def _coating(content: Mapping[str, Any]) -> CoatingFigure:
    low, high, cell = _pair(content["low"]), _pair(content["high"]), _positive(content["cell"])
    x, y = (b - a for a, b in zip(low, high, strict=True))
    if x <= 0.0 or y <= 0.0:
        raise ValueError("a layer whose `high` is not above its `low`")
    if ceil(x / cell) * ceil(y / cell) > _MOST_CELLS:
        raise ValueError(f"a layer with cells of {cell} m has more than {_MOST_CELLS} of them")
    return CoatingFigure(low, high, cell, _vector(content["colour"], 0.0, 1.0))


def _sample(content: Mapping[str, Any], before: PoseSample, stage: Stage | None) -> PoseSample:
    if stage is None:
        raise ValueError("the first line has no `schema`")
    (time,) = _numbers([content["t"]], 1, before.time, _LATEST)
    changed: dict[str, Any] = {"time": time}
    if "q" in content:
        changed["joints"] = tuple(_numbers(content["q"]))
    if "gap" in content:
        (changed["gap"],) = _numbers([content["gap"]], 1)
    for key in {"base", "command"} & content.keys():
        changed[key] = _vector(content[key])
    if "people" in content:
        changed["people"] = tuple(map(_person, content["people"]))
    if "move" in content:
        moved = {
            int(number): None if pose is None else _pose(pose) for number, pose in content["move"].items()
        }
        if any(not 0 <= number < len(stage.actors) for number in moved):
            raise ValueError("an actor that the first line does not have")
        changed["poses"] = {**before.poses, **moved}
    if "coated" in content:
        coated = {name: _cells(cells) for name, cells in content["coated"].items()}
        if unknown := coated.keys() - stage.coatings.keys():
            raise ValueError(f"layers that the first line does not have: {', '.join(sorted(unknown))}")
        changed["coated"] = {**before.coated, **coated}
    if "cameras" in content:
        moved_cameras = {
            name: _moved_camera(stage.cameras[name], place) for name, place in content["cameras"].items()
        }
        changed["cameras"] = {**before.cameras, **moved_cameras}
    sample = replace(before, **changed)
    if len(sample.joints) != len(stage.robot.rows):
        raise ValueError(f"{len(sample.joints)} joint positions in place of {len(stage.robot.rows)}")
    return sample


def _cells(content: Any) -> str:
    cells = _text(content)
    if len(cells) > _MOST_CELLS or cells.strip("01"):
        raise ValueError(f"the cells of a layer are not at most {_MOST_CELLS} characters `0` and `1`")
    return cells


def _person(content: Sequence[Any]) -> PersonFigure:
    x, y, floor, height, radius = content
    return PersonFigure(*_vector((x, y, floor)), _positive(height), _positive(radius))


def _camera(content: Mapping[str, Any]) -> Camera:
    width, height = content["size"]
    if not (type(width) is type(height) is int and 1 <= width <= _GREATEST and 1 <= height <= _GREATEST):
        raise ValueError(f"{width} x {height} pixels are no size of a picture")
    angle = _positive(content["field_of_view"])
    if angle >= 180.0:
        raise ValueError(f"a field of view of {angle} degrees is not below 180")
    return _looking(
        Camera(
            _vector(content["eye"]), _vector(content["target"]), _vector(content["up"]), angle, width, height
        )
    )


def _moved_camera(camera: Camera, place: Iterable[Any]) -> Camera:
    numbers = [*_numbers(place, 9)]
    eye, target, up = (_vector(numbers[start : start + 3]) for start in (0, 3, 6))
    return _looking(replace(camera, eye=eye, target=target, up=up))


def _looking(camera: Camera) -> Camera:
    try:
        camera_axes(camera)
    except ArithmeticError as failure:
        raise ValueError("a camera at its target, or that looks along its `up`") from failure
    return camera


def _shape(content: Sequence[Any]) -> VisualShape:
    kind, size, colour, opacity, place = content
    if kind not in SHAPE_KINDS:
        raise ValueError(f"`{kind}` is no shape")
    return VisualShape(
        kind,
        _vector(size, 0.0),
        _vector(colour, 0.0, 1.0),
        _pose(place),
        *_numbers([opacity], 1, 0.0, 1.0),
    )


def _pose(content: Sequence[Any]) -> Pose:
    x, y, z, a, b, c, d = _numbers(content, 7)
    if abs(hypot(a, b, c, d) - 1.0) > _UNIT_WITHIN:
        raise ValueError(f"the quaternion {[a, b, c, d]} has not the length 1")
    return Pose((x, y, z), (a, b, c, d))


def _vector(content: Iterable[Any], least: float = -_GREATEST, most: float = _GREATEST) -> Vector3:
    x, y, z = _numbers(content, 3, least, most)
    return (x, y, z)


def _row(content: Iterable[Any]) -> Row:
    a, alpha, d, *others = _numbers(content)
    if not others:
        return (a, alpha, d)
    zero, *kind = others
    if kind not in ([], [PRISMATIC]):
        raise ValueError(f"a joint of no known kind: {kind}")
    return (a, alpha, d, zero, PRISMATIC) if kind else (a, alpha, d, zero)


def _pair(content: Iterable[Any]) -> tuple[float, float]:
    x, y = _numbers(content, 2)
    return (x, y)


def _positive(content: Any) -> float:
    (number,) = _numbers([content], 1)
    if number <= 0.0:
        raise ValueError(f"{number} is not above 0")
    return number


def _numbers(
    content: Iterable[Any], count: int | None = None, least: float = -_GREATEST, most: float = _GREATEST
) -> Iterator[float]:
    """Yield numbers.

    Raises:
        ValueError: one is no number from `least` to `most`, or there are not `count` of them.
    """
    numbers = list(content)
    if count is not None and len(numbers) != count:
        raise ValueError(f"{len(numbers)} numbers in place of {count}")
    for number in numbers:
        # Compared first: a whole number of many digits has no float.
        if type(number) not in (int, float) or not least <= number <= most:
            raise ValueError(f"`{str(number)[:40]}` is no number from {least:g} to {most:g}")
        yield float(number)


def _text(content: Any) -> str:
    if type(content) is not str:
        raise ValueError(f"`{content}` is no text")
    return content
