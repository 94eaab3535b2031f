"""Shapes that people and cameras see, as numbers: boxes, cylinders, spheres, capsules and ellipsoids."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal, NamedTuple, get_args

from aeros.sim.geometry import UPRIGHT, Pose, Vector3
from aeros.sim.pictures.solids import basin_boxes
from aeros.spec.model.scene import Basin, Box, Colour, Compound, Cylinder, Sphere

ShapeKind = Literal["box", "cylinder", "sphere", "capsule", "ellipsoid"]
SHAPE_KINDS: frozenset[str] = frozenset(get_args(ShapeKind))


class VisualShape(NamedTuple):
    """A visible part of a link.

    Attributes:
        kind: its kind.
        size: full lengths of a box or an ellipsoid; radius and height of a cylinder, then 0; radius of a
            sphere, then 0, 0; radius and length of the straight part of a capsule, then 0; m.
        colour: red, green and blue in [0, 1].
        place: pose of its middle in the frame of its link.
        opacity: 1 of what is opaque, 0 of what is invisible.
    """

    kind: ShapeKind
    size: Vector3
    colour: Colour
    place: Pose = Pose((0.0, 0.0, 0.0), UPRIGHT)
    opacity: float = 1.0


def shapes_of(shape: Box | Cylinder | Sphere | Basin | Compound, colour: Colour) -> Iterator[VisualShape]:
    """Yield the visible shapes of a body of a scene.

    Args:
        shape: its shape.
        colour: its colour; parts of a compound have their own.

    Yields:
        The shapes in the body's frame.
    """
    match shape:
        case Box(edges):
            yield VisualShape("box", edges, colour)
        case Cylinder(radius, height):
            yield VisualShape("cylinder", (radius, height, 0.0), colour)
        case Sphere(radius):
            yield VisualShape("sphere", (radius, 0.0, 0.0), colour)
        case Basin(inner):
            for edges, middle in basin_boxes(inner):
                yield VisualShape("box", edges, colour, Pose(middle, UPRIGHT))
        case Compound(parts):
            for part in parts:
                for one in shapes_of(part.shape, part.colour):
                    yield one._replace(place=Pose(part.position, UPRIGHT))
