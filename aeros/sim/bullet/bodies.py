"""Bodies of a scene in a PyBullet world, with their links and joints."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

from aeros.sim.bullet.body_factory import RigidPart
from aeros.sim.bullet.client import bullet
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.engine.engine import PlacedBody
from aeros.sim.engine.world import Rgba
from aeros.sim.geometry import Pose
from aeros.sim.pictures.solids import basin_boxes
from aeros.spec.model.scene import (
    Basin,
    Box,
    Compound,
    Cylinder,
    SceneBody,
    Sphere,
    UrdfModel,
)

_FIXED_JOINT: Final = bullet.JOINT_FIXED


def add_body(world: PhysicsWorld, body: SceneBody, pose: Pose) -> PlacedBody:
    """Add a body of a scene to a world.

    Args:
        world: the world.
        body: the body.
        pose: of its frame in W.

    Returns:
        The body in the world.

    Raises:
        UserError: PyBullet cannot load its URDF file.
    """
    links: dict[str, int] = {}
    joints: dict[str, int] = {}
    if isinstance(body.shape, UrdfModel):
        number = world.bodies.add_urdf(
            body.shape.path, *pose, fixed=not body.is_movable, friction=body.friction
        )
        links, joints = _names(world, number)
        _set_model(world, body, body.shape, number, links, joints)
    else:
        number = _add_rigid(world, body, pose)
        world.bodies.set_friction(number, -1, body.friction, body.spinning)
    if body.rolling_resistance > 0.0:
        world.bodies.set_rolling_resistance(number, body.rolling_resistance)
    return PlacedBody(body, number, links, joints)


def _add_rigid(world: PhysicsWorld, body: SceneBody, pose: Pose) -> int:
    colour = (*body.colour, 1.0)
    match body.shape:
        case Box(edges):
            return world.bodies.add_box(edges, *pose, mass=body.mass, colour=colour, friction=body.friction)
        case Cylinder(radius, height):
            return world.bodies.add_cylinder(
                radius, height, *pose, mass=body.mass, colour=colour, friction=body.friction
            )
    parts = list(_parts(body, colour))
    return world.bodies.add_parts(parts, *pose, mass=body.mass, friction=body.friction)


def _parts(body: SceneBody, colour: Rgba) -> Iterator[RigidPart]:
    match body.shape:
        case Sphere(radius):
            yield RigidPart(bullet.GEOM_SPHERE, (radius, 0.0, 0.0), (0.0, 0.0, 0.0), colour)
        case Basin(inner):
            for edges, middle in basin_boxes(inner):
                yield RigidPart(bullet.GEOM_BOX, edges, middle, colour)
        case Compound(parts):
            for part in parts:
                own = (*part.colour, 1.0)
                match part.shape:
                    case Box(edges):
                        yield RigidPart(bullet.GEOM_BOX, edges, part.position, own)
                    case Cylinder(radius, height):
                        yield RigidPart(bullet.GEOM_CYLINDER, (radius, height, 0.0), part.position, own)
                    case Sphere(radius):
                        yield RigidPart(bullet.GEOM_SPHERE, (radius, 0.0, 0.0), part.position, own)


def _names(world: PhysicsWorld, number: int) -> tuple[dict[str, int], dict[str, int]]:
    """Return the numbers of a model's links and of its movable joints, by name."""
    links = {bullet.getBodyInfo(number, physicsClientId=world.client)[0].decode(): -1}
    joints = {}
    for joint in range(bullet.getNumJoints(number, physicsClientId=world.client)):
        info = bullet.getJointInfo(number, joint, physicsClientId=world.client)
        links[info[12].decode()] = joint
        if info[2] != _FIXED_JOINT:
            joints[info[1].decode()] = joint
    return links, joints


def _set_model(
    world: PhysicsWorld,
    body: SceneBody,
    model: UrdfModel,
    number: int,
    links: Mapping[str, int],
    joints: Mapping[str, int],
) -> None:
    for link, link_number in links.items():
        world.bodies.set_friction(
            number, link_number, model.link_friction.get(link, body.friction), body.spinning
        )
    for joint, joint_number in joints.items():
        settings = model.joint_settings.get(joint)
        world.bodies.set_joint_friction(number, joint_number, 0.0 if settings is None else settings.friction)
        if settings is not None and settings.range is not None:
            low, high = settings.range
            bullet.changeDynamics(
                number,
                joint_number,
                jointLowerLimit=low,
                jointUpperLimit=high,
                physicsClientId=world.client,
            )
