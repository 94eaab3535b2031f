"""Bodies that a scene file adds to a scene, and the check that no two bodies overlap."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple

from aeros.sim.bullet.body_factory import Colour
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.geometry import Vector3, yaw_orientation
from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.diagnostics.source import SourceSpan

MAX_OVERLAP: Final = 0.002
"""Greatest allowed overlap of two bodies, m: the robot's foot overlaps its table by 1.03 mm."""

GREY: Final[Colour] = (0.7, 0.7, 0.7, 1.0)


class Box(NamedTuple):
    """A box.

    Attributes:
        edges: full lengths of its edges along its own x, y and z, m.
    """

    edges: Vector3


class Cylinder(NamedTuple):
    """A cylinder about its own z axis.

    Attributes:
        radius: m.
        height: full height, m.
    """

    radius: float
    height: float


class UrdfModel(NamedTuple):
    """A URDF file that `check_urdf` has accepted.

    Attributes:
        path: path of the file.
    """

    path: str


@dataclass(frozen=True, slots=True)
class SceneBody:
    """A declared body in a scene.

    Attributes:
        name: as declared.
        shape: box, cylinder or URDF model.
        position: of its middle in W, m; for a URDF model, of its frame.
        yaw: about z of W, rad.
        mass: kg; 0 fixes it to W. A URDF model has the mass in its file, unless this is 0.
        friction: Coulomb coefficient.
        colour: red, green, blue and alpha in [0, 1].
        span: where it is declared.
    """

    name: str
    shape: Box | Cylinder | UrdfModel
    position: Vector3
    yaw: float
    mass: float
    friction: float
    colour: Colour
    span: SourceSpan


def add_body(world: PhysicsWorld, body: SceneBody) -> int:
    """Add a declared body to a world.

    Args:
        world: the world.
        body: the body.

    Returns:
        Its number in PyBullet.

    Raises:
        UserError: PyBullet cannot load its URDF file.
    """
    turn, friction = yaw_orientation(body.yaw), body.friction
    match body.shape:
        case Box(edges):
            return world.bodies.add_box(
                edges, body.position, turn, mass=body.mass, colour=body.colour, friction=friction
            )
        case Cylinder(radius, height):
            return world.bodies.add_cylinder(
                radius, height, body.position, turn, mass=body.mass, colour=body.colour, friction=friction
            )
        case UrdfModel(path):
            return world.bodies.add_urdf(path, body.position, turn, fixed=body.mass == 0.0, friction=friction)


def check_overlaps(world: PhysicsWorld, placed: Mapping[int, SceneBody], names: Mapping[int, str]) -> None:
    """Check that no two bodies of a world overlap by more than `MAX_OVERLAP`.

    Overlapping bodies are thrown apart as soon as the world steps.

    Args:
        world: the world.
        placed: declared bodies by their number in PyBullet.
        names: names of other bodies, by number.

    Raises:
        UserError: some overlap; it lists every pair.
    """
    problems = [
        _overlap_diagnostic(first, second, depth, world, placed, names)
        for first, second, depth in world.overlaps(MAX_OVERLAP)
    ]
    if problems:
        raise UserError(problems)


def _overlap_diagnostic(
    one: int,
    other: int,
    depth: float,
    world: PhysicsWorld,
    placed: Mapping[int, SceneBody],
    names: Mapping[int, str],
) -> Diagnostic:
    first, second = sorted((one, other), key=lambda body: body not in placed)
    spoken = [_body_name(body, world, placed, names) for body in (first, second)]
    declared = [placed[body] for body in (first, second) if body in placed]
    labels = [SpanLabel(body.span, f"`{body.name}` is placed here") for body in declared]
    return Diagnostic(
        "AE140",
        f"{spoken[0]} and {spoken[1]} overlap by {_format_mm(depth)}",
        labels[0] if labels else None,
        tuple(labels[1:]),
        help=(f"move one of them, or make it smaller, by at least {_format_mm(depth)}",) if labels else (),
    )


def _body_name(
    body: int, world: PhysicsWorld, placed: Mapping[int, SceneBody], names: Mapping[int, str]
) -> str:
    if body in placed:
        return f"`{placed[body].name}`"
    if body in names:
        return names[body]
    x, y, z = world.pose(body).position
    return f"the body at ({x:.2f}, {y:.2f}, {z:.2f}) m"


def _format_mm(depth: float) -> str:
    return f"{1000.0 * depth:.1f} mm"
