"""Copy the visible shapes of a world to another PyBullet client, and update their poses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, NamedTuple

from aeros.sim.bullet.client import bullet
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.engine.world import Rgba
from aeros.sim.geometry import Pose, Vector3

BASE_LINK: Final = -1
"""The link number of a body's base."""


class Shape(NamedTuple):
    """A visible part of a link.

    Attributes:
        body: number of its body in the original world.
        link: number of the link; `BASE_LINK` for the base.
        kind: PyBullet's shape type.
        size: dimensions as `getVisualShapeData` gives them, m.
        mesh: file of a mesh; else empty.
        place: pose in the link's frame.
        colour: red, green, blue and alpha in [0, 1].
    """

    body: int
    link: int
    kind: int
    size: Vector3
    mesh: str
    place: Pose
    colour: Rgba


def bodies_of(world: PhysicsWorld) -> list[int]:
    """List the bodies of a world.

    Args:
        world: the world.

    Returns:
        Their numbers in PyBullet, the newest last.
    """
    client = world.client
    count = bullet.getNumBodies(physicsClientId=client)
    return [bullet.getBodyUniqueId(number, physicsClientId=client) for number in range(count)]


def shapes_of(world: PhysicsWorld, bodies: Sequence[int]) -> list[Shape]:
    """List the visible parts of bodies.

    A rectangle by `BodyFactory.add_textured_rectangle` is left out, as its mesh is not a file.

    Args:
        world: the world.
        bodies: numbers of the bodies.

    Returns:
        The shapes.
    """
    return [
        Shape(body, link, kind, size, mesh.decode(), Pose(position, orientation), colour)
        for number in bodies
        for body, link, kind, size, mesh, position, orientation, colour in (
            data[:8] for data in bullet.getVisualShapeData(number, physicsClientId=world.client)
        )
        if mesh or kind != bullet.GEOM_MESH
    ]


def poses_of(world: PhysicsWorld, shapes: Sequence[Shape]) -> list[Pose]:
    """Read the pose of each shape's link.

    Args:
        world: the world.
        shapes: shapes in it.

    Returns:
        Poses in W, in the order of `shapes`.
    """
    poses: dict[tuple[int, int], Pose] = {}
    for shape in shapes:
        key = (shape.body, shape.link)
        if key not in poses:
            poses[key] = world.frame_pose(shape.body) if shape.link == BASE_LINK else world.pose(*key)
    return [poses[shape.body, shape.link] for shape in shapes]


class SceneMirror:
    """Copies of shapes in a PyBullet client that have no mass and no contacts and never step.

    Args:
        client: number of the client.
    """

    def __init__(self, client: int) -> None:
        self._client = client
        self._bodies: list[int] = []

    def add(self, shapes: Sequence[Shape]) -> None:
        """Add shapes.

        Args:
            shapes: shapes of the original world.
        """
        self._bodies += [
            bullet.createMultiBody(baseVisualShapeIndex=self._visual(shape), physicsClientId=self._client)
            for shape in shapes
        ]

    def place(self, poses: Sequence[Pose]) -> None:
        """Move every shape to its link's pose.

        Args:
            poses: in W, one for each shape in the order in which they were added.
        """
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
