"""Solids that a picture shows: convex polyhedra and spheres, in the frame of the body that they belong to.

Units: m.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations
from math import cos, hypot, pi, sin
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeros.sim.geometry import UPRIGHT, Pose, Vector3
from aeros.spec.model.scene import BASIN_WALL, Basin, Box, Colour, Compound, Cylinder, Sphere

Array = NDArray[np.float64]

_SIDES: Final = 48
"""Number of faces around a cylinder: of a radius of 50 mm, it is 0.1 mm too thin at most."""

_FLAT: Final = 1e-9
"""Distance of a corner from a face's plane up to which it lies in it, m, and of two normals that are one."""


class Solid(NamedTuple):
    """A convex solid of one colour.

    Attributes:
        normals: outward normals of its faces (n, 3); empty for a sphere.
        offsets: distance of each face from the origin along its normal (n,), m.
        radius: of the ball around its middle that encloses it, m; of a sphere, its radius.
        colour: red, green and blue in [0, 1].
        place: pose of its middle in the frame of its body.
    """

    normals: Array
    offsets: Array
    radius: float
    colour: Colour
    place: Pose = Pose((0.0, 0.0, 0.0), UPRIGHT)


def box(edges: Vector3, colour: Colour) -> Solid:
    """Make a box.

    Args:
        edges: full lengths along x, y and z, m.
        colour: its colour.

    Returns:
        The solid, its middle at the origin.
    """
    half = np.array(edges) / 2.0
    normals = np.concatenate((np.eye(3), -np.eye(3)))
    return Solid(normals, np.concatenate((half, half)), hypot(*half.tolist()), colour)


def cylinder(radius: float, height: float, colour: Colour) -> Solid:
    """Make a cylinder about z, as a prism.

    Args:
        radius: its radius, m.
        height: full height, m.
        colour: its colour.

    Returns:
        The solid, its middle at the origin.
    """
    angles = [2.0 * pi * number / _SIDES for number in range(_SIDES)]
    sides = [(cos(angle), sin(angle), 0.0) for angle in angles]
    normals = np.array([*sides, (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)])
    offsets = np.array([radius * cos(pi / _SIDES)] * _SIDES + [height / 2.0] * 2)
    return Solid(normals, offsets, hypot(radius, height / 2.0), colour)


def sphere(radius: float, colour: Colour) -> Solid:
    """Make a sphere.

    Args:
        radius: its radius, m.
        colour: its colour.

    Returns:
        The solid, its middle at the origin.
    """
    return Solid(np.empty((0, 3)), np.empty(0), radius, colour)


def hull(corners: Sequence[Vector3], colour: Colour) -> Solid:
    """Make the convex hull of a few points that do not lie in one plane.

    Every three points span a plane; it has a face if all others are on one side of it.

    Args:
        corners: the points, m.
        colour: its colour.

    Returns:
        The solid; its middle is the mean of the corners.
    """
    points = np.array(corners)
    middle = points.mean(axis=0)
    points = points - middle
    a, b, c = (points[list(numbers)] for numbers in zip(*combinations(range(len(points)), 3), strict=True))
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1)
    spans = lengths > _FLAT**0.5 * 1e-2
    normals, a = normals[spans] / lengths[spans, None], a[spans]
    offsets = (normals * a).sum(axis=1)
    normals, offsets = normals * np.where(offsets < 0, -1.0, 1.0)[:, None], np.abs(offsets)
    is_face = (normals @ points.T <= offsets[:, None] + _FLAT).all(axis=1)
    faces = np.unique(np.round(np.column_stack((normals[is_face], offsets[is_face])), 7), axis=0)
    radius = float(np.linalg.norm(points, axis=1).max())
    x, y, z = middle.tolist()
    return Solid(faces[:, :3], faces[:, 3], radius, colour, Pose((x, y, z), UPRIGHT))


def solids_of_shape(shape: Box | Cylinder | Sphere | Basin | Compound, colour: Colour) -> Iterator[Solid]:
    """Yield the solids of a body of a scene.

    Args:
        shape: its shape.
        colour: its colour; parts of a compound have their own.

    Yields:
        The solids in the body's frame.
    """
    match shape:
        case Box(edges):
            yield box(edges, colour)
        case Cylinder(radius, height):
            yield cylinder(radius, height, colour)
        case Sphere(radius):
            yield sphere(radius, colour)
        case Basin(inner):
            for edges, middle in basin_boxes(inner):
                yield box(edges, colour)._replace(place=Pose(middle, UPRIGHT))
        case Compound(parts):
            for part in parts:
                for one in solids_of_shape(part.shape, part.colour):
                    yield one._replace(place=Pose(part.position, UPRIGHT))


def basin_boxes(inner: Vector3) -> tuple[tuple[Vector3, Vector3], ...]:
    """Build a box without a lid from a floor and four walls.

    Args:
        inner: inner length, width and depth, m.

    Returns:
        Edges and middle of each of the five boxes, in the frame of the middle of the floor's top, m.
    """
    length, width, depth = inner
    wall = BASIN_WALL
    across, along = (length + wall) / 2, (width + wall) / 2
    return (
        ((length + 2 * wall, width + 2 * wall, wall), (0.0, 0.0, -wall / 2)),
        ((wall, width + 2 * wall, depth), (-across, 0.0, depth / 2)),
        ((length, wall, depth), (0.0, -along, depth / 2)),
        ((wall, width + 2 * wall, depth), (across, 0.0, depth / 2)),
        ((length, wall, depth), (0.0, along, depth / 2)),
    )
