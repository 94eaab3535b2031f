"""Meshes of hulls: closed, convex, around all points; and files that name their bounds truly."""

from __future__ import annotations

import json
from collections import Counter
from struct import unpack_from

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.runtime.bus.viewer.hull_meshes import encode_glb, hull_triangles
from aeros.runtime.ports import ColouredMesh
from tests.hypothesis_profiles import examples
from tests.repo.tree import ROOT

Corner = tuple[float, float, float]
CUBE: list[Corner] = [(x, y, z) for x in (0.0, 1.0) for y in (0.0, 2.0) for z in (0.0, 3.0)]


def in_front(corners: list[Corner], face: tuple[int, int, int], point: Corner) -> float:
    a, b, c = (corners[one] for one in face)
    u, v, w = ([p - q for p, q in zip(one, a, strict=True)] for one in (b, c, point))
    return (
        (u[1] * v[2] - u[2] * v[1]) * w[0]
        + (u[2] * v[0] - u[0] * v[2]) * w[1]
        + (u[0] * v[1] - u[1] * v[0]) * w[2]
    )


def check(corners: list[Corner]) -> None:
    faces = hull_triangles(corners)
    edges = Counter(edge for a, b, c in faces for edge in ((a, b), (b, c), (c, a)))
    assert set(edges.values()) == {1}
    assert all((b, a) in edges for a, b in edges)
    assert max(in_front(corners, face, one) for face in faces for one in corners) < 1e-9


def test_a_box_has_twelve_faces() -> None:
    check(CUBE)
    assert len(hull_triangles(CUBE)) == 12


@examples(30)
@given(st.lists(st.tuples(*[st.integers(-20, 20)] * 3), min_size=4, max_size=25, unique=True))
def test_every_hull_is_closed_and_has_all_points_behind_its_faces(points: list[tuple[int, int, int]]) -> None:
    corners = [(x / 16, y / 16, z / 16) for x, y, z in points]
    if hull_triangles(corners):
        check(corners)


@pytest.mark.parametrize("corners", [[], CUBE[:3], [(float(x), float(x * x), 0.0) for x in range(9)]])
def test_points_in_a_plane_have_no_hull(corners: list[Corner]) -> None:
    assert hull_triangles(corners) == []


def test_the_links_of_the_shipped_robots_have_hulls() -> None:
    for path in sorted((ROOT / "aeros" / "robots").glob("*_hulls.json")):
        for hull in json.loads(path.read_text())["hulls"]:
            check([(x, y, z) for x, y, z in hull["corners"]])


def test_the_file_has_the_corners_with_y_up() -> None:
    other = ColouredMesh(((0.25, 0.0, 0.0), (0.0, 0.5, 0.0), (0.0, 0.0, 1.0)), ((0, 1, 2),), (1.0, 0.0, 0.5))
    file = encode_glb([ColouredMesh(CUBE, hull_triangles(CUBE), (0.02, 0.5, 1.0)), other])
    magic, version, length = unpack_from("<4sII", file)
    assert (magic, version, length) == (b"glTF", 2, len(file))
    size, kind = unpack_from("<I4s", file, 12)
    assert kind == b"JSON"
    scene = json.loads(file[20 : 20 + size])
    data_size, data_kind = unpack_from("<I4s", file, 20 + size)
    assert (data_kind, data_size) == (b"BIN\0", scene["buffers"][0]["byteLength"])
    data = file[28 + size :]
    assert len(data) == data_size
    positions, numbers, other_positions, other_numbers = scene["accessors"]
    assert (positions["min"], positions["max"]) == ([0.0, 0.0, -2.0], [1.0, 3.0, 0.0])
    assert (positions["count"], numbers["count"]) == (8, 36)
    assert (other_positions["count"], other_numbers["count"]) == (3, 3)
    corners = [unpack_from("<3f", data, 12 * one) for one in range(8)]
    assert corners == [(x, z, -y) for x, y, z in CUBE]
    at = [one["byteOffset"] for one in scene["bufferViews"]]
    assert list(unpack_from("<36I", data, at[1])) == [one for face in hull_triangles(CUBE) for one in face]
    assert unpack_from("<3f", data, at[2]) == (0.25, 0.0, 0.0)
    assert unpack_from("<3I", data, at[3]) == (0, 1, 2)
    assert [one["indices"] for one in scene["meshes"][0]["primitives"]] == [1, 3]
    colours = [one["pbrMetallicRoughness"]["baseColorFactor"] for one in scene["materials"]]
    # IEC 61966-2-1: 0.5 in sRGB is 0.214 of the light of 1.
    assert colours[0] == pytest.approx([0.02 / 12.92, 0.214, 1.0, 1.0], abs=1e-3)
    assert colours[1] == pytest.approx([1.0, 0.0, 0.214, 1.0], abs=1e-3)


def test_the_scene_is_that_of_gltf_2() -> None:
    """Numbers of the Khronos specification: 5126 float, 5125 unsigned int, 34962 and 34963 targets."""
    surface = ColouredMesh(((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 2.0)), ((0, 1, 2),), (0.0, 0.0, 1.0))
    file = encode_glb([surface, surface])
    (size,) = unpack_from("<I", file, 12)
    scene = json.loads(file[20 : 20 + size])
    material = {"baseColorFactor": [0.0, 0.0, 1.0, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.8}
    corners = {"componentType": 5126, "type": "VEC3", "count": 3, "min": [0, 0, 0], "max": [1, 2, 0]}
    numbers = {"componentType": 5125, "type": "SCALAR", "count": 3}
    assert scene == {
        "asset": {"version": "2.0", "generator": "AEROS"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [
            {
                "primitives": [
                    {"attributes": {"POSITION": 0}, "indices": 1, "material": 0},
                    {"attributes": {"POSITION": 2}, "indices": 3, "material": 1},
                ]
            }
        ],
        "materials": [{"pbrMetallicRoughness": material}] * 2,
        "buffers": [{"byteLength": 96}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": at, "byteLength": length, "target": target}
            for at, length, target in ((0, 36, 34962), (36, 12, 34963), (48, 36, 34962), (84, 12, 34963))
        ],
        "accessors": [
            {"bufferView": view, **one} for view, one in enumerate((corners, numbers, corners, numbers))
        ],
    }
