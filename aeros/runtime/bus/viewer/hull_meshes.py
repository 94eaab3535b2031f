"""Meshes of convex hulls, and binary glTF files of meshes."""

from __future__ import annotations

import json
from array import array
from collections.abc import Sequence
from itertools import chain
from math import sqrt
from struct import pack
from sys import byteorder
from typing import Any, Final

from aeros.runtime.ports import ColouredMesh, Vec3

Triangle = tuple[int, int, int]

_FLAT: Final = 1e-12
"""Volume up to which a corner counts as on a face, m³."""

_MAGIC, _VERSION, _JSON, _BINARY = 0x46546C67, 2, 0x4E4F534A, 0x004E4942
_FLOAT, _UNSIGNED_INT, _ARRAY_BUFFER, _ELEMENT_ARRAY_BUFFER = 5126, 5125, 34962, 34963
"""Numbers of the glTF 2.0 specification."""

_BOUNDS: Final = (("min", min), ("max", max))


def hull_triangles(corners: Sequence[Vec3]) -> list[Triangle]:
    """Find the faces of the convex hull of points.

    Starts with a tetrahedron, and for each further point replaces the faces that the point is in front of by
    a fan to the edge of the region that they cover.

    Args:
        corners: the points, m.

    Returns:
        Numbers of the corners of each face, counterclockwise from outside; none if all points are in a plane.
    """
    first = _tetrahedron(corners)
    if first is None:
        return []
    a, b, c, d = first
    faces: set[Triangle] = {(a, b, c), (a, d, b), (b, d, c), (c, d, a)}
    for number, corner in enumerate(corners):
        if number in first:
            continue
        seen = {face for face in faces if _volume(corners, face, corner) > _FLAT}
        edges = {edge for face in seen for edge in _edges(face)}
        faces -= seen
        faces |= {(one, other, number) for one, other in edges if (other, one) not in edges}
    return sorted(faces)


def encode_glb(surfaces: Sequence[ColouredMesh]) -> bytes:
    """Encode a mesh as a binary glTF 2.0 file.

    The up axis of glTF is y and that of robots z, so viewers turn files by a right angle about x. The file
    has coordinates that are right after that. It has no normals: viewers compute those of flat faces.

    Args:
        surfaces: the parts of the mesh.

    Returns:
        The file.
    """
    data = bytearray()
    views: list[dict[str, int]] = []
    accessors: list[dict[str, Any]] = []
    for surface in surfaces:
        points = array("f", (one for x, y, z in surface.corners for one in (x, z, -y)))
        numbers = array("I", chain.from_iterable(surface.triangles))
        bounds = {name: [edge(points[axis::3]) for axis in range(3)] for name, edge in _BOUNDS}
        for values, target, accessor in (
            (points, _ARRAY_BUFFER, {"componentType": _FLOAT, "type": "VEC3", **bounds}),
            (numbers, _ELEMENT_ARRAY_BUFFER, {"componentType": _UNSIGNED_INT, "type": "SCALAR"}),
        ):
            count = len(values) // (3 if values is points else 1)
            accessors.append({"bufferView": len(views), "count": count, **accessor})
            size = len(values) * values.itemsize
            views.append({"buffer": 0, "byteOffset": len(data), "byteLength": size, "target": target})
            if byteorder == "big":
                values.byteswap()
            data += values.tobytes()
    scene = {
        "asset": {"version": "2.0", "generator": "AEROS"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [
            {
                "primitives": [
                    {"attributes": {"POSITION": 2 * number}, "indices": 2 * number + 1, "material": number}
                    for number in range(len(surfaces))
                ]
            }
        ],
        "materials": [
            {
                "pbrMetallicRoughness": {
                    "baseColorFactor": [*map(_linear, one.colour), 1.0],
                    "metallicFactor": 0.0,
                    "roughnessFactor": 0.8,
                }
            }
            for one in surfaces
        ],
        "buffers": [{"byteLength": len(data)}],
        "bufferViews": views,
        "accessors": accessors,
    }
    text = json.dumps(scene, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = pack("<II", len(text), _JSON) + text + pack("<II", len(data), _BINARY) + data
    return pack("<III", _MAGIC, _VERSION, 12 + len(chunks)) + chunks


def _linear(part: float) -> float:
    """Convert a part of an sRGB colour to the linear one that glTF has."""
    return part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4


def _edges(face: Triangle) -> tuple[tuple[int, int], ...]:
    a, b, c = face
    return ((a, b), (b, c), (c, a))


def _tetrahedron(corners: Sequence[Vec3]) -> tuple[int, int, int, int] | None:
    """Return four corners that span a volume, the fourth behind the face of the others; None if none do."""
    numbers = range(len(corners))
    if len(corners) < 4:
        return None
    a = min(numbers, key=lambda one: corners[one])
    b = max(numbers, key=lambda one: _length(_minus(corners[one], corners[a])))
    along = _minus(corners[b], corners[a])
    c = max(numbers, key=lambda one: _length(_cross(along, _minus(corners[one], corners[a]))))
    d = max(numbers, key=lambda one: abs(_volume(corners, (a, b, c), corners[one])))
    volume = _volume(corners, (a, b, c), corners[d])
    if abs(volume) <= _FLAT:
        return None
    return (a, b, c, d) if volume < 0.0 else (a, c, b, d)


def _volume(corners: Sequence[Vec3], face: Triangle, point: Vec3) -> float:
    """Return six times the volume between a face and a point, positive if the point is in front of it."""
    a, b, c = (corners[number] for number in face)
    normal = _cross(_minus(b, a), _minus(c, a))
    return sum(one * other for one, other in zip(normal, _minus(point, a), strict=True))


def _minus(one: Vec3, other: Vec3) -> Vec3:
    return (one[0] - other[0], one[1] - other[1], one[2] - other[2])


def _cross(one: Vec3, other: Vec3) -> Vec3:
    (a, b, c), (d, e, f) = one, other
    return (b * f - c * e, c * d - a * f, a * e - b * d)


def _length(vector: Vec3) -> float:
    return sqrt(sum(one * one for one in vector))
