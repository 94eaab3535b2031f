"""Meshes of convex hulls, as binary glTF files."""

from __future__ import annotations

import json
from collections.abc import Sequence
from math import sqrt
from struct import pack, unpack
from typing import Final

from aeros.runtime.ports import Vec3

Triangle = tuple[int, int, int]

_FLAT: Final = 1e-12
"""Volume up to which a corner counts as on a face, m³."""

_MAGIC, _VERSION, _JSON, _BINARY = 0x46546C67, 2, 0x4E4F534A, 0x004E4942
_FLOAT, _ARRAY_BUFFER = 5126, 34962
"""Numbers of the glTF 2.0 specification."""


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


def encode_glb(corners: Sequence[Vec3], triangles: Sequence[Triangle]) -> bytes:
    """Encode a mesh with flat faces as a binary glTF 2.0 file.

    The up axis of glTF is y and that of robots z, so viewers turn files by a right angle about x. The file
    has coordinates that are right after that.

    Args:
        corners: positions, m.
        triangles: numbers of the corners of each face.

    Returns:
        The file.
    """
    points, normals = [], []
    for triangle in triangles:
        places = [corners[number] for number in triangle]
        points += places
        normals += [_normal(*places)] * 3
    low, high = (tuple(edge(one) for one in zip(*map(_turn, points), strict=True)) for edge in (min, max))
    size = 12 * len(points)
    views = [{"buffer": 0, "byteOffset": at, "byteLength": size, "target": _ARRAY_BUFFER} for at in (0, size)]
    accessor = {"componentType": _FLOAT, "count": len(points), "type": "VEC3"}
    primitive = {"attributes": {"POSITION": 0, "NORMAL": 1}, "material": 0}
    scene = {
        "asset": {"version": "2.0", "generator": "AEROS"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [primitive]}],
        "materials": [{"pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.8}}],
        "buffers": [{"byteLength": 2 * size}],
        "bufferViews": views,
        "accessors": [
            {"bufferView": 0, "min": _single(low), "max": _single(high), **accessor},
            {"bufferView": 1, **accessor},
        ],
    }
    text = json.dumps(scene, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    data = b"".join(pack("<3f", *_turn(one)) for one in (*points, *normals))
    chunks = pack("<II", len(text), _JSON) + text + pack("<II", len(data), _BINARY) + data
    return pack("<III", _MAGIC, _VERSION, 12 + len(chunks)) + chunks


def _single(values: Sequence[float]) -> list[float]:
    """Round as the positions in the file are: their bounds must be exact."""
    return list(unpack("<3f", pack("<3f", *values)))


def _turn(point: Vec3) -> Vec3:
    x, y, z = point
    return (x, z, -y)


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


def _normal(a: Vec3, b: Vec3, c: Vec3) -> Vec3:
    x, y, z = _cross(_minus(b, a), _minus(c, a))
    length = _length((x, y, z)) or 1.0
    return (x / length, y / length, z / length)


def _minus(one: Vec3, other: Vec3) -> Vec3:
    return (one[0] - other[0], one[1] - other[1], one[2] - other[2])


def _cross(one: Vec3, other: Vec3) -> Vec3:
    (a, b, c), (d, e, f) = one, other
    return (b * f - c * e, c * d - a * f, a * e - b * d)


def _length(vector: Vec3) -> float:
    return sqrt(sum(one * one for one in vector))
