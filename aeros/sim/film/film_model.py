"""A MuJoCo model of a recording's bodies, which are put where they are in each picture and never step."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final
from xml.etree.ElementTree import ParseError

import numpy as np

from aeros.kinematic_chain import Mounting, frames_of, mounting_of
from aeros.sim.film.meshes import Mesh, meshes_of_urdf, rounded_corners, stock_urdf_file
from aeros.sim.film.person_shapes import PERSON_PARTS, Stance, part_poses
from aeros.sim.film.recording import CoatingFigure, PoseSample, Recording, RecordingError, RobotFigure
from aeros.sim.geometry import UPRIGHT, Pose, Vector3, compose
from aeros.sim.mujoco.client import mujoco
from aeros.sim.mujoco.model import wxyz
from aeros.sim.pictures.solids import Array
from aeros.sim.pictures.urdf_model import UrdfVisuals
from aeros.sim.pictures.visual_shapes import VisualShape
from aeros.sim.robot.model import links_of
from aeros.spec.model.scene import Colour

SHOWN_GROUP: Final = 0
HIDDEN_GROUP: Final = 5
"""Groups of shapes that a picture shows, and of those that it does not."""

_HULL_ROUNDING: Final = 0.012
"""Radius with which the hulls of links are rounded, m."""

_SUN: Final = (0.75, -0.6, 2.0)
"""Position of the light that casts shadows, from the arm's base, m."""

_FLOOR_EDGE: Final = 2.0
"""Length and width from which on a thin box is a floor, m."""

_FLOOR_GAP: Final = 0.03
"""Distance of the ground below the floor of a scene, m: nearer ones cannot be told apart from afar."""

_LINK_COLOUR: Final[Colour] = (0.93, 0.93, 0.94)
_JOINT_COLOUR: Final[Colour] = (0.25, 0.25, 0.27)
_CARRIAGE_COLOUR: Final[Colour] = (0.32, 0.34, 0.38)

_FINGER: Final = (0.022, 0.012, 0.055)
"""Edges of a finger of which there is no mesh, m."""

_KINDS: Final = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "sphere": mujoco.mjtGeom.mjGEOM_SPHERE,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
    "ellipsoid": mujoco.mjtGeom.mjGEOM_ELLIPSOID,
}


@dataclass(frozen=True)
class _Places:
    """Numbers in the model of what is put from place to place."""

    robot: tuple[int, ...]
    carriage: int | None
    actors: tuple[int, ...]
    people: tuple[tuple[int, ...], ...]


class FilmModel:
    """The bodies of a recording.

    Args:
        recording: the recording.
        size: width and height of the greatest picture, pixels.

    Raises:
        RecordingError: a shape has no volume.

    Attributes:
        model: the `MjModel`.
        data: its state, the `MjData`.
    """

    def __init__(self, recording: Recording, size: tuple[int, int]) -> None:
        stage = recording.stage
        self._spec = _empty_description(size)
        self._count = 0
        self._arm = arm_of(stage.robot)
        self._places = self._add_bodies(recording)
        floor = min((one for sample in recording.samples for one in _floors(sample)), default=None)
        self._add_floor(_lowest(recording) if floor is None else floor)
        self._cells = {name: self._add_cells(one) for name, one in stage.coatings.items()}
        try:
            self.model = self._spec.compile()
        except ValueError as failure:
            raise RecordingError(f"a shape of the recording cannot be drawn: {failure}") from failure
        self.data = mujoco.MjData(self.model)
        self._shapes_of = [
            np.flatnonzero(self.model.geom_bodyid == number) for number in range(self.model.nbody)
        ]
        self._mocap: Mapping[int, int] = {
            number: int(mocap) for number, mocap in enumerate(self.model.body_mocapid) if mocap >= 0
        }

    def place(self, sample: PoseSample, people: Sequence[Stance]) -> None:
        """Put everything where it is in a picture.

        Args:
            sample: the picture.
            people: stances of the people.
        """
        places = self._places
        for number, pose in zip(places.robot, self._arm.poses(sample), strict=True):
            self._put(number, pose)
        if places.carriage is not None:
            self._put(places.carriage, Pose(sample.base, UPRIGHT))
        for index, number in enumerate(places.actors):
            self._show_at(number, sample.poses.get(index))
        for index, parts in enumerate(places.people):
            poses = part_poses(people[index]) if index < len(people) else [None] * len(parts)
            for number, place in zip(parts, poses, strict=True):
                self._show_at(number, place)
        for name, (first, count) in self._cells.items():
            left = np.frombuffer(sample.coated.get(name, "").encode("latin-1"), np.uint8) == ord("1")
            shown = np.zeros(count, dtype=np.bool_)
            shown[: len(left)] = left[:count]
            self.model.geom_group[first : first + count] = np.where(shown, SHOWN_GROUP, HIDDEN_GROUP)
        self.model.light_pos[0] = np.add(sample.base, _SUN)
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_camlight(self.model, self.data)

    # Internals.

    def _put(self, number: int, pose: Pose) -> None:
        mocap = self._mocap[number]
        self.data.mocap_pos[mocap] = pose.position
        self.data.mocap_quat[mocap] = wxyz(pose.orientation)

    def _show_at(self, number: int, pose: Pose | None) -> None:
        """Put a body to a place, or hide it."""
        self.model.geom_group[self._shapes_of[number]] = HIDDEN_GROUP if pose is None else SHOWN_GROUP
        if pose is not None:
            self._put(number, pose)

    def _add_bodies(self, recording: Recording) -> _Places:
        stage = recording.stage
        robot = tuple(self._add(part.shapes, part.meshes) for part in self._arm.parts)
        carriage = None
        if stage.robot.carriage is not None:
            carriage = self._add(tuple(_carriage_shapes(stage.robot.carriage)), ())
        actors = tuple(
            self._add(one.shapes if pose is None else self._without_floors(one.shapes, pose), ())
            for number, one in enumerate(stage.actors)
            for pose in (recording.samples[0].poses.get(number),)
        )
        crowd = max(len(sample.people) for sample in recording.samples)
        people = tuple(tuple(self._add(part, ()) for part in PERSON_PARTS) for _ in range(crowd))
        return _Places(robot, carriage, actors, people)

    def _add(self, shapes: Sequence[VisualShape], meshes: Sequence[tuple[Pose, Mesh]]) -> int:
        """Add a body that is put from place to place; return its number."""
        self._count += 1
        body = self._spec.worldbody.add_body(name=str(self._count), mocap=True)
        for shape in shapes:
            _add_shape(body, shape)
        for index, (pose, mesh) in enumerate(meshes):
            name = f"{self._count}/{index}"
            named: dict[str, Any] = {"uservert": mesh.corners.ravel().tolist()}
            if len(mesh.triangles):
                named["userface"] = mesh.triangles.ravel().tolist()
            self._spec.add_mesh(name=name, inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL, **named)
            body.add_geom(
                type=mujoco.mjtGeom.mjGEOM_MESH,
                meshname=name,
                pos=pose.position,
                quat=wxyz(pose.orientation),
                rgba=(*mesh.colour, 1.0),
                material="robot",
                **_UNTOUCHED,
            )
        return self._count

    def _without_floors(self, shapes: Sequence[VisualShape], pose: Pose) -> tuple[VisualShape, ...]:
        """Add the tops of wide level boxes as planes, which cast no shadow on themselves; return the rest."""
        floors = [
            one
            for one in shapes
            if one.kind == "box" and min(one.size[:2]) >= _FLOOR_EDGE and one.size[2] < 0.2
        ]
        for one in floors:
            (x, y, z), turn = compose(pose, one.place)
            a, b, c = one.size
            self._spec.worldbody.add_geom(
                type=mujoco.mjtGeom.mjGEOM_PLANE,
                size=(a / 2.0, b / 2.0, 0.1),
                pos=(x, y, z + c / 2.0),
                quat=wxyz(turn),
                rgba=(*one.colour, 1.0),
                **_UNTOUCHED,
            )
        return tuple(one for one in shapes if one not in floors)

    def _add_floor(self, height: float) -> None:
        self._spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            size=(12.0, 12.0, 0.1),
            pos=(0.0, 0.0, height - _FLOOR_GAP),
            material="floor",
            **_UNTOUCHED,
        )

    def _add_cells(self, coating: CoatingFigure) -> tuple[int, int]:
        """Add a layer as flakes, one for each cell; return the number of the first and how many there are."""
        columns, rows = (
            np.arange(low + coating.cell / 2, high, coating.cell)
            for low, high in zip(coating.low, coating.high, strict=True)
        )
        first = self._spec.worldbody.geoms
        number, chance = len(first), np.random.default_rng(0)
        for y in rows.tolist():
            for x in columns.tolist():
                shade, size, turn = (
                    chance.uniform(0.75, 1.15),
                    chance.uniform(0.45, 0.85),
                    chance.uniform(0, 3.1),
                )
                off = chance.uniform(-0.3, 0.3, 2) * coating.cell
                red, green, blue = (min(1.0, shade * part) for part in coating.colour)
                edge = size * coating.cell
                self._spec.worldbody.add_geom(
                    type=mujoco.mjtGeom.mjGEOM_BOX,
                    size=(edge, 0.7 * edge, 0.0008),
                    pos=(x + float(off[0]), y + float(off[1]), 0.001),
                    quat=(np.cos(turn / 2), 0.0, 0.0, np.sin(turn / 2)),
                    rgba=(red, green, blue, 1.0),
                    **_UNTOUCHED,
                )
        return number, len(rows) * len(columns)


_UNTOUCHED: Final = {"contype": 0, "conaffinity": 0, "mass": 0.0, "group": SHOWN_GROUP}


def _add_shape(body: Any, shape: VisualShape) -> None:
    a, b, c = shape.size
    half = (a, b / 2.0, 0.0) if shape.kind in ("cylinder", "capsule") else (a / 2.0, b / 2.0, c / 2.0)
    body.add_geom(
        type=_KINDS[shape.kind],
        size=(a, 0.0, 0.0) if shape.kind == "sphere" else half,
        pos=shape.place.position,
        quat=wxyz(shape.place.orientation),
        rgba=(*shape.colour, shape.opacity),
        **_UNTOUCHED,
    )


def _empty_description(size: tuple[int, int]) -> Any:
    """Return the description of an empty room with soft light."""
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.stat.center, spec.stat.extent = (0.5, 0.0, 0.3), 3.0
    look = spec.visual
    look.global_.offwidth, look.global_.offheight = size
    look.quality.shadowsize, look.quality.offsamples = 4096, 4
    look.headlight.ambient = (0.42, 0.42, 0.44)
    look.headlight.diffuse = (0.30, 0.30, 0.30)
    look.headlight.specular = (0.05, 0.05, 0.05)
    look.map.znear, look.map.zfar = 0.02, 30.0
    look.map.shadowclip, look.map.fogstart, look.map.fogend = 5.0, 3.0, 6.0
    look.rgba.fog = (0.86, 0.89, 0.93, 1.0)
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=(0.93, 0.95, 0.97),
        rgb2=(0.80, 0.85, 0.91),
        width=256,
        height=256,
    )
    spec.add_texture(
        name="tiles",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        mark=mujoco.mjtMark.mjMARK_EDGE,
        rgb1=(0.73, 0.75, 0.78),
        rgb2=(0.76, 0.78, 0.81),
        markrgb=(0.66, 0.68, 0.72),
        width=256,
        height=256,
    )
    floor = spec.add_material(
        name="floor", texuniform=True, texrepeat=(1.0, 1.0), specular=0.1, shininess=0.1
    )
    floor.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "tiles"
    spec.add_material(name="robot", specular=0.35, shininess=0.45)
    spec.worldbody.add_light(
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        pos=_SUN,
        dir=(-0.30, 0.30, -1.0),
        diffuse=(0.52, 0.51, 0.48),
        specular=(0.25, 0.25, 0.25),
        castshadow=True,
    )
    spec.worldbody.add_light(
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        pos=(-2.0, 2.0, 3.0),
        dir=(0.6, -0.5, -0.6),
        diffuse=(0.16, 0.17, 0.20),
        specular=(0.0, 0.0, 0.0),
        castshadow=False,
    )
    return spec


def _floors(sample: PoseSample) -> Iterator[float]:
    yield from (person.floor for person in sample.people)


def _lowest(recording: Recording) -> float:
    """Return the height of the lowest box of a scene, m."""
    first = recording.samples[0]
    heights = [
        pose.position[2] + shape.place.position[2] + shape.size[2] / 2.0
        for number, actor in enumerate(recording.stage.actors)
        for shape in actor.shapes
        if (pose := first.poses.get(number)) is not None and shape.kind == "box"
    ]
    return min(heights, default=0.0)


def _carriage_shapes(edges: tuple[float, float, float]) -> Iterator[VisualShape]:
    """Yield a base with four wheels below the arm's base frame."""
    x, y, z = edges
    wheel = 0.09
    yield VisualShape(
        "box", (x, y, z - wheel), _CARRIAGE_COLOUR, Pose((0.0, 0.0, -(z - wheel) / 2.0), UPRIGHT)
    )
    yield VisualShape(
        "box", (x + 0.01, y + 0.01, 0.02), (0.95, 0.62, 0.10), Pose((0.0, 0.0, -z + wheel), UPRIGHT)
    )
    lying = (2.0**-0.5, 0.0, 0.0, 2.0**-0.5)
    for along in (-1.0, 1.0):
        for side in (-1.0, 1.0):
            place = Pose((along * (x / 2.0 - wheel), side * (y / 2.0 - 0.03), -z + wheel - 0.03), lying)
            yield VisualShape("cylinder", (wheel - 0.005, 0.05, 0.0), _JOINT_COLOUR, place)


# The arm.


@dataclass(frozen=True)
class ArmPart:
    """A link of the arm, or a finger.

    Attributes:
        shapes: shapes in its frame.
        meshes: meshes with their poses in its frame.
    """

    shapes: tuple[VisualShape, ...] = ()
    meshes: tuple[tuple[Pose, Mesh], ...] = ()


class _HullLinks:
    """Links that are drawn by their hulls."""

    def __init__(self, robot: RobotFigure, hulls: Sequence[tuple[str, int, tuple[Vector3, ...]]]) -> None:
        self._mountings: tuple[Mounting, ...] = tuple(mounting_of(row) for row in robot.rows)
        self._joints = [joint for _, joint, _ in hulls]
        self.parts = tuple(
            ArmPart(meshes=((Pose((0.0, 0.0, 0.0), UPRIGHT), _hull_mesh(corners, number)),))
            for number, (_, _, corners) in enumerate(hulls)
        )

    def frames(self, sample: PoseSample) -> list[Pose]:
        """Return the poses of all joints' frames in B, the base's first."""
        return [
            Pose(frame.origin, _orientation(np.array(frame[1:]).T))
            for frame in frames_of(self._mountings, sample.joints)
        ]

    def poses(self, sample: PoseSample) -> Iterator[Pose]:
        """Yield the pose of each link in W."""
        if self._joints:
            base, frames = Pose(sample.base, UPRIGHT), self.frames(sample)
            for joint in self._joints:
                yield compose(base, frames[joint])


class MeshArm:
    """An arm whose links have mesh files; standing arms beside it are drawn by their hulls.

    Args:
        robot: the robot.
        visuals: links and joints of its URDF file.
        meshes: the meshes by link.

    Attributes:
        parts: its links.
    """

    def __init__(
        self, robot: RobotFigure, visuals: UrdfVisuals, meshes: Mapping[str, tuple[tuple[Pose, Mesh], ...]]
    ) -> None:
        self._joints = robot.urdf_joints
        self._visuals = visuals
        self._links = tuple(meshes)
        own = links_of(len(robot.rows))
        self._standing = _HullLinks(robot, [one for one in robot.hulls if one[0] not in own])
        self.parts = (*(ArmPart(meshes=one) for one in meshes.values()), *self._standing.parts)

    def poses(self, sample: PoseSample) -> Iterator[Pose]:
        """Place the links.

        Args:
            sample: a picture.

        Yields:
            Pose of each part in W.
        """
        positions = dict.fromkeys(self._visuals.sliding_joints, sample.gap / 2.0)
        positions |= dict(zip(self._joints, sample.joints, strict=False))
        base = Pose(sample.base, UPRIGHT)
        for link in self._links:
            yield compose(base, self._visuals.link_pose(link, positions))
        yield from self._standing.poses(sample)


class HullArm:
    """An arm that is drawn by the hulls of its links, with two fingers.

    Args:
        robot: the robot.
    """

    def __init__(self, robot: RobotFigure) -> None:
        self._links = _HullLinks(robot, [one for one in robot.hulls if one[0] != "fingers"])
        self._robot = robot
        finger = ArmPart((VisualShape("box", _FINGER, _JOINT_COLOUR),))
        self.parts = (*self._links.parts, finger, finger)

    def poses(self, sample: PoseSample) -> Iterator[Pose]:
        """Place the links.

        Args:
            sample: a picture.

        Yields:
            Pose of each part in W.
        """
        yield from self._links.poses(sample)
        last = compose(Pose(sample.base, UPRIGHT), self._links.frames(sample)[-1])
        half = self._robot.turn / 2.0
        hand = Pose((0.0, 0.0, self._robot.flange), (0.0, 0.0, float(np.sin(half)), float(np.cos(half))))
        reach = self._robot.tool + 0.008 - _FINGER[2] / 2.0
        for side in (-1.0, 1.0):
            place = Pose((0.0, side * (sample.gap + _FINGER[1]) / 2.0, reach), UPRIGHT)
            yield compose(compose(last, hand), place)


def _hull_mesh(corners: Sequence[tuple[float, float, float]], number: int) -> Mesh:
    colour = _LINK_COLOUR if number % 2 == 0 else (0.80, 0.81, 0.83)
    return Mesh(rounded_corners(corners, _HULL_ROUNDING), np.zeros((0, 3), dtype=np.int32), colour)


def _orientation(axes: Array) -> tuple[float, float, float, float]:
    found = np.zeros(4)
    mujoco.mju_mat2Quat(found, axes.ravel())
    w, x, y, z = found.tolist()
    return (x, y, z, w)


def arm_of(robot: RobotFigure) -> MeshArm | HullArm:
    """Choose how an arm is drawn.

    Args:
        robot: the robot.

    Returns:
        The arm, by its meshes if they are installed and can be read, else by its hulls.
    """
    path = stock_urdf_file(robot.urdf)
    if path is None:
        return HullArm(robot)
    meshes: dict[str, tuple[tuple[Pose, Mesh], ...]] = {}
    try:
        for one in meshes_of_urdf(path):
            meshes[one.link] = (*meshes.get(one.link, ()), (one.place, one.mesh))
        return MeshArm(robot, UrdfVisuals(str(path)), meshes)
    except (LookupError, OSError, ParseError, ValueError):
        return HullArm(robot)
