"""Meshes are read with their materials, and hulls are rounded."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from aeros.sim.film.meshes import meshes_of_urdf, read_obj, rounded_corners

OBJ = """
mtllib box.mtl
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 0 0 1
usemtl red
f 1/1 2/2/2 3//3 4
usemtl unknown
f -1 1 2
"""
MTL = "newmtl red\nKd 1 0 0\n"
URDF = """<robot name="one"><link name="arm"><visual><origin xyz="0 0 2"/><geometry>
<mesh filename="package://box.obj"/></geometry></visual></link></robot>"""


def test_polygons_are_split_into_triangles_by_material(tmp_path: Path) -> None:
    (tmp_path / "box.obj").write_text(OBJ)
    red, other = read_obj(tmp_path / "box.obj")
    assert other.colour == red.colour
    (tmp_path / "box.mtl").write_text(MTL)
    red, other = read_obj(tmp_path / "box.obj")
    assert red.colour == (1.0, 0.0, 0.0) != other.colour
    assert red.corners[red.triangles].tolist() == [
        [[0, 0, 0], [1, 0, 0], [1, 1, 0]],
        [[0, 0, 0], [1, 1, 0], [0, 1, 0]],
    ]
    assert other.corners[other.triangles].tolist() == [[[0, 0, 1], [0, 0, 0], [1, 0, 0]]]
    (tmp_path / "one.urdf").write_text(URDF)
    links = list(meshes_of_urdf(tmp_path / "one.urdf"))
    assert [(one.link, one.place.position) for one in links] == [("arm", (0.0, 0.0, 2.0))] * 2


def test_a_rounded_hull_is_wider_by_the_radius() -> None:
    corners = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
    points = rounded_corners(corners, 0.1)
    gaps = np.linalg.norm(points[:, None, :] - np.array(corners)[None], axis=2).min(axis=1)
    assert np.allclose(gaps, 0.1)
