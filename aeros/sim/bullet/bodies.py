"""Bodies that are put into a scene from outside, and whether any two in a world are in each other's place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple

from aeros.sim.bullet.world import Colour, World
from aeros.sim.geometry import Triple, turned
from aeros.spec.diagnostics.codes import Diagnostic, Label
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.diagnostics.source import Span

OVERLAP: Final = 0.002
"""How deep two bodies may be in each other, m: the robot's foot is 1.03 mm deep in its table."""

GREY: Final[Colour] = (0.7, 0.7, 0.7, 1.0)


class Box(NamedTuple):
    """Full lengths of its edges, m."""

    edges: Triple


class Cylinder(NamedTuple):
    """About its own z axis, m."""

    radius: float
    height: float


class Model(NamedTuple):
    """A URDF file, read and found usable."""

    path: str


@dataclass(frozen=True, slots=True)
class Body:
    """Something that stands or lies about.

    at: its middle in W, m; of a model its frame.
    mass: kg; 0: fixed to W.  Of a model whatever its file says, unless this is 0.
    span: where it is declared.
    """

    name: str
    shape: Box | Cylinder | Model
    at: Triple
    yaw: float
    mass: float
    friction: float
    colour: Colour
    span: Span


def place(world: World, body: Body) -> int:
    """Put it where it is declared."""
    turn, friction = turned(body.yaw), body.friction
    match body.shape:
        case Box(edges):
            return world.add_box(edges, body.at, turn, mass=body.mass, colour=body.colour, friction=friction)
        case Cylinder(radius, height):
            return world.add_cylinder(
                radius, height, body.at, turn, mass=body.mass, colour=body.colour, friction=friction
            )
        case Model(path):
            return world.add_urdf(path, body.at, turn, fixed=body.mass == 0.0, friction=friction)


def refuse_overlaps(world: World, placed: Mapping[int, Body], names: Mapping[int, str]) -> None:
    """Raise `UserError` with every two bodies of `world` that are in each other's place.

    What overlaps is thrown apart as soon as time goes on.
    placed: those that were declared; names: of the others, as far as they have one.
    """
    found = [_told(one, other, depth, world, placed, names) for one, other, depth in world.overlaps(OVERLAP)]
    if found:
        raise UserError(found)


def _told(
    one: int, other: int, depth: float, world: World, placed: Mapping[int, Body], names: Mapping[int, str]
) -> Diagnostic:
    first, second = sorted((one, other), key=lambda body: body not in placed)
    spoken = [_name(body, world, placed, names) for body in (first, second)]
    declared = [placed[body] for body in (first, second) if body in placed]
    labels = [Label(body.span, f"`{body.name}` is here") for body in declared]
    return Diagnostic(
        "AE140",
        f"{spoken[0]} and {spoken[1]} overlap by {_millimetres(depth)}",
        labels[0] if labels else None,
        tuple(labels[1:]),
        help=(f"move one of them, or make it smaller, by at least {_millimetres(depth)}",) if labels else (),
    )


def _name(body: int, world: World, placed: Mapping[int, Body], names: Mapping[int, str]) -> str:
    if body in placed:
        return f"`{placed[body].name}`"
    if body in names:
        return names[body]
    x, y, z = world.pose(body).position
    return f"what the scene has at ({x:.2f}, {y:.2f}, {z:.2f}) m"


def _millimetres(depth: float) -> str:
    return f"{1000.0 * depth:.1f} mm"
