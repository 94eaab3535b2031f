"""Convex solids: their faces enclose exactly what they stand for."""

from __future__ import annotations

from itertools import product
from math import hypot

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.sim.pictures.solids import (
    Solid,
    basin_boxes,
    box,
    cylinder,
    hull,
    solids_of_shape,
    sphere,
)
from aeros.spec.model.scene import Basin, Box, Compound, Cylinder, Part, Sphere

RED = (1.0, 0.0, 0.0)


def holds(solid: Solid, point: tuple[float, float, float]) -> bool:
    """True if a point, from the solid's middle, is on the inner side of every face."""
    return bool((solid.normals @ np.array(point) <= solid.offsets + 1e-9).all())


def test_a_box_is_between_its_faces() -> None:
    solid = box((0.2, 0.4, 0.6), RED)
    assert holds(solid, (0.1, 0.2, 0.3))
    for point in ((0.101, 0.0, 0.0), (0.0, -0.201, 0.0), (0.0, 0.0, 0.301)):
        assert not holds(solid, point)
    assert solid.radius == pytest.approx(hypot(0.1, 0.2, 0.3))


@given(st.floats(0.0, 6.3), st.floats(0.0, 0.999))
def test_a_cylinder_is_round_to_a_part_in_300(angle: float, share: float) -> None:
    solid = cylinder(0.05, 0.1, RED)
    x, y = np.cos(angle), np.sin(angle)
    assert holds(solid, (share * 0.997 * 0.05 * x, share * 0.997 * 0.05 * y, 0.05))
    assert not holds(solid, (0.0501 * x, 0.0501 * y, 0.0))
    assert not holds(solid, (0.0, 0.0, 0.051))


def test_a_sphere_has_no_faces() -> None:
    assert len(sphere(0.3, RED).offsets) == 0
    assert sphere(0.3, RED).radius == 0.3


def test_the_hull_of_a_boxs_corners_and_of_points_inside_is_the_box() -> None:
    corners = [(1.0 + 0.1 * a, 2.0 + 0.2 * b, 3.0 + 0.3 * c) for a, b, c in product((-1, 1), repeat=3)]
    solid = hull([*corners, *((1.0, 2.0 + 0.01 * n, 3.0) for n in (-1, 1))], RED)
    assert solid.place.position == pytest.approx((1.0, 2.0, 3.0))
    assert sorted(solid.offsets.tolist()) == pytest.approx([0.1, 0.1, 0.2, 0.2, 0.3, 0.3])
    assert solid.radius == pytest.approx(hypot(0.1, 0.2, 0.3))


@given(st.lists(st.tuples(*[st.floats(-1.0, 1.0)] * 3), min_size=6, max_size=12))
def test_a_hull_holds_its_corners(corners: list[tuple[float, float, float]]) -> None:
    points = np.array(corners)
    if np.linalg.svd(points - points.mean(axis=0), compute_uv=False)[2] < 0.05:
        return  # nearly flat
    solid = hull(corners, RED)
    away = points - np.array(solid.place.position)
    assert (away @ solid.normals.T <= solid.offsets + 1e-6).all()
    # Each face touches corners.
    assert (np.abs(away @ solid.normals.T - solid.offsets).min(axis=0) < 1e-6).all()


def test_a_basin_is_a_floor_and_four_walls_that_do_not_overlap() -> None:
    boxes = basin_boxes((0.2, 0.1, 0.05))
    assert len(boxes) == 5
    bottom, *walls = boxes
    assert bottom[1] == pytest.approx((0.0, 0.0, -0.0025))
    for (length, width, _), (x, y, z) in walls:
        assert abs(x) - length / 2 >= 0.1 - 1e-9 or abs(y) - width / 2 >= 0.05 - 1e-9
        assert z == 0.025


def test_every_shape_of_a_scene_has_solids_where_its_parts_are() -> None:
    blue = (0.0, 0.0, 1.0)
    whole = Compound(
        (Part(Box((1.0, 1.0, 1.0)), (0.0, 0.0, 2.0), blue), Part(Sphere(0.1), (0.0, 1.0, 0.0), RED))
    )
    found = list(solids_of_shape(whole, RED))
    assert [(one.colour, one.place.position) for one in found] == [
        (blue, (0.0, 0.0, 2.0)),
        (RED, (0.0, 1.0, 0.0)),
    ]
    assert len(list(solids_of_shape(Basin((0.2, 0.1, 0.05)), RED))) == 5
    assert len(list(solids_of_shape(Cylinder(0.1, 0.2), RED))) == 1
