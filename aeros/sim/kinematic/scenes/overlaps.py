"""Check that no two bodies of a layout overlap, by geometry alone.

The depth of an overlap is the length of the shortest way that separates two convex parts. It is along a
normal of one of their faces, or across an edge of each (the theorem of separating axes). A cylinder counts as
a prism and a sphere as a polyhedron inside it, so a depth is up to 1 % of the radius off. Units: m. Frame: W.

Not checked: meshes of models, and the robot.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations, product
from math import cos, pi, sin
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeros.sim.geometry import Pose, Vector3, compose, to_world
from aeros.sim.layouts.overlap_faults import MAX_OVERLAP, overlap_fault
from aeros.sim.pictures.solids import Solid, solids_of_shape
from aeros.sim.pictures.urdf_model import UrdfVisuals
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.model.scene import Scene, SceneBody, UrdfModel

Array = NDArray[np.float64]

_SAME: Final = 1e-7
"""Difference of two directions, or distance of a corner from a face, that counts as none, m."""


class ConvexPart(NamedTuple):
    """A convex part of a body.

    Attributes:
        corners: its corners (n, 3), m.
        normals: directions across its faces (k, 3), each once for both sides.
        edges: directions of its edges (m, 3), likewise.
    """

    corners: Array
    normals: Array
    edges: Array


def check_overlaps(scene: Scene, poses: Mapping[str, Pose]) -> None:
    """Check that no two bodies overlap by more than `MAX_OVERLAP`.

    Args:
        scene: the scene.
        poses: pose in W of each body at the start, by name; joints are at 0.

    Raises:
        UserError: some overlap; it lists every pair.
    """
    parts = {name: list(_parts(body, poses[name])) for name, body in scene.bodies.items()}
    faults = []
    for first, second in combinations(scene.bodies.values(), 2):
        pairs = product(parts[first.name], parts[second.name])
        depth = max((overlap_depth(one, other) for one, other in pairs), default=0.0)
        if depth > MAX_OVERLAP:
            faults.append(overlap_fault(f"`{first.name}`", f"`{second.name}`", (first, second), depth))
    if faults:
        raise UserError(faults)


def overlap_depth(first: ConvexPart, second: ConvexPart) -> float:
    """Compute the length of the shortest way that separates two parts.

    Args:
        first: one of them.
        second: the other.

    Returns:
        The length, m; 0 if they do not overlap.
    """
    low, high = first.corners.min(axis=0), first.corners.max(axis=0)
    if (low >= second.corners.max(axis=0)).any() or (high <= second.corners.min(axis=0)).any():
        return 0.0
    across = np.cross(first.edges[:, None, :], second.edges[None, :, :]).reshape(-1, 3)
    lengths = np.linalg.norm(across, axis=1)
    skew = lengths > 1e-3  # else the edges are parallel
    axes = np.concatenate((first.normals, second.normals, across[skew] / lengths[skew, None]))
    one, other = first.corners @ axes.T, second.corners @ axes.T
    ways = np.minimum(one.max(axis=0) - other.min(axis=0), other.max(axis=0) - one.min(axis=0))
    return max(0.0, float(ways.min()))


def _parts(body: SceneBody, pose: Pose) -> Iterator[ConvexPart]:
    """Yield the parts of a body where it is."""
    if isinstance(body.shape, UrdfModel):
        model = UrdfVisuals(body.shape.path, "collision")
        for link, solid in model.solids:
            yield _placed(solid, compose(compose(pose, model.link_pose(link, {})), solid.place))
    else:
        for solid in solids_of_shape(body.shape, body.colour):
            yield _placed(solid, compose(pose, solid.place))


def _placed(solid: Solid, pose: Pose) -> ConvexPart:
    corners = _sphere_corners(solid.radius) if not len(solid.normals) else _corners(solid)
    origin = np.array(pose.position)
    turned = [np.array(to_world(pose, _vector(row))) - origin for row in (*corners, *solid.normals)]
    at, normals = np.array(turned[: len(corners)]), np.array(turned[len(corners) :]).reshape(-1, 3)
    if not len(normals):  # a sphere: from its middle to each corner
        return ConvexPart(at + origin, _once(at), np.empty((0, 3)))
    edges = np.array([np.cross(a, b) for a, b in combinations(normals, 2)])
    return ConvexPart(at + origin, _once(normals), _once(edges))


def _corners(solid: Solid) -> Array:
    """Return the points where three faces meet and that lie behind all others (n, 3), m."""
    triples = np.array(list(combinations(range(len(solid.normals)), 3)))
    rows, offsets = solid.normals[triples], solid.offsets[triples]
    meets = np.abs(np.linalg.det(rows)) > 1e-6
    points = np.linalg.solve(rows[meets], offsets[meets][..., None])[..., 0]
    inside = (points @ solid.normals.T <= solid.offsets + _SAME).all(axis=1)
    return np.unique(np.round(points[inside], 9), axis=0)


def _sphere_corners(radius: float) -> Array:
    """Return points of a sphere around the origin, 15 degrees apart (n, 3), m."""
    angles = [pi * number / 12 for number in range(24)]
    ring = [
        (sin(polar) * cos(angle), sin(polar) * sin(angle), cos(polar))
        for polar in angles[1:12]
        for angle in angles
    ]
    return radius * np.array([(0.0, 0.0, 1.0), *ring, (0.0, 0.0, -1.0)])


def _once(directions: Array) -> Array:
    """Return unit vectors along directions, each once, whichever way it points."""
    lengths = np.linalg.norm(directions, axis=1)
    units = directions[lengths > _SAME] / lengths[lengths > _SAME, None]
    # The first number that is not 0 is made positive.
    first = np.argmax(np.abs(units) > _SAME, axis=1)
    units = units * np.sign(units[np.arange(len(units)), first])[:, None]
    return np.unique(np.round(units, 7) + 0.0, axis=0)


def _vector(row: Array) -> Vector3:
    x, y, z = row.tolist()
    return (x, y, z)
