"""What a world looks like, put up again in another PyBullet client: bodies that are only seen."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, NamedTuple

from aeros.sim.bullet.client import bullet
from aeros.sim.bullet.world import Colour, PhysicsWorld
from aeros.sim.geometry import Pose, Vector3

BASE_LINK: Final = -1
"""The link number of a body's base."""


class Shape(NamedTuple):
    """A visible part of a link.

    kind, size: PyBullet's shape type, and its dimensions as `getVisualShapeData` gives them, m.
    mesh: the file of a mesh; empty otherwise.
    place: in the link's frame.
    """

    body: int
    link: int
    kind: int
    size: Vector3
    mesh: str
    place: Pose
    colour: Colour


def bodies_of(world: PhysicsWorld) -> list[int]:
    """Everything that is in the world, what came last at the end."""
    client = world.client
    count = bullet.getNumBodies(physicsClientId=client)
    return [bullet.getBodyUniqueId(number, physicsClientId=client) for number in range(count)]


def shapes_of(world: PhysicsWorld, bodies: Sequence[int]) -> list[Shape]:
    """The visible parts of `bodies`; a picture (`PhysicsWorld.add_textured_rectangle`) is none, as its mesh is no file."""
    return [
        Shape(body, link, kind, size, mesh.decode(), Pose(position, orientation), colour)
        for number in bodies
        for body, link, kind, size, mesh, position, orientation, colour in (
            data[:8] for data in bullet.getVisualShapeData(number, physicsClientId=world.client)
        )
        if mesh or kind != bullet.GEOM_MESH
    ]


def poses_of(world: PhysicsWorld, shapes: Sequence[Shape]) -> list[Pose]:
    """Where the frame of each shape's link is, in W."""
    found: dict[tuple[int, int], Pose] = {}
    for shape in shapes:
        key = (shape.body, shape.link)
        if key not in found:
            found[key] = _base_frame(world, shape.body) if shape.link == BASE_LINK else world.pose(*key)
    return [found[shape.body, shape.link] for shape in shapes]


def _base_frame(world: PhysicsWorld, body: int) -> Pose:
    """The frame that the base's visible parts are placed in; PyBullet tells where its centre of mass is."""
    info = bullet.getDynamicsInfo(body, BASE_LINK, physicsClientId=world.client)
    return Pose(*bullet.multiplyTransforms(*world.pose(body), *bullet.invertTransform(info[3], info[4])))


class SceneMirror:
    """Shows shapes in `client`.  Nothing in it has weight, is touched or steps."""

    def __init__(self, client: int) -> None:
        self._client = client
        self._bodies: list[int] = []

    def add(self, shapes: Sequence[Shape]) -> None:
        """Put up more shapes."""
        self._bodies += [
            bullet.createMultiBody(baseVisualShapeIndex=self._visual(shape), physicsClientId=self._client)
            for shape in shapes
        ]

    def place(self, poses: Sequence[Pose]) -> None:
        """Put each shape, in the order in which they came, where its link is."""
        for body, pose in zip(self._bodies, poses, strict=True):
            bullet.resetBasePositionAndOrientation(body, *pose, physicsClientId=self._client)

    def _visual(self, shape: Shape) -> int:
        along, across, _ = shape.size
        own: dict[int, dict[str, Any]] = {
            bullet.GEOM_BOX: {"halfExtents": [edge / 2.0 for edge in shape.size]},
            bullet.GEOM_CYLINDER: {"length": along, "radius": across},
            bullet.GEOM_CAPSULE: {"length": along, "radius": across},
            bullet.GEOM_SPHERE: {"radius": along},
            bullet.GEOM_MESH: {"fileName": shape.mesh, "meshScale": shape.size},
        }
        visual: int = bullet.createVisualShape(
            shape.kind,
            rgbaColor=shape.colour,
            visualFramePosition=shape.place.position,
            visualFrameOrientation=shape.place.orientation,
            physicsClientId=self._client,
            **own[shape.kind],
        )
        return visual
