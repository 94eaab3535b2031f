"""Pictures by rays: depth, colour, what hides what, and pictures on surfaces."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from aeros.perception.points import point_cloud
from aeros.sim.geometry import UPRIGHT, Camera, Pose, yaw_orientation
from aeros.sim.pictures.ray_caster import Decal, cast, place
from aeros.sim.pictures.solids import Solid, box, cylinder, sphere

ABOVE = Camera((0.5, 0.2, 2.0), (0.5, 0.2, 0.0), up=(1.0, 0.0, 0.0), field_of_view=40.0, width=64, height=48)
OBLIQUE = Camera((0.0, -1.0, 1.0), (0.5, 0.2, 0.0), width=64, height=48)
RED, BLUE = (0.8, 0.1, 0.1), (0.1, 0.1, 0.8)
FLOOR = place(box((9.0, 9.0, 0.1), (0.5, 0.5, 0.5)), Pose((0.0, 0.0, -0.05), UPRIGHT))


def put(solid: Solid, *at: float, yaw: float = 0.0) -> Any:
    x, y, z = at
    return place(solid, Pose((x, y, z), yaw_orientation(yaw)))


def points_of(camera: Camera, depth: Any) -> Any:
    return point_cloud(depth, camera.eye, camera.target, camera.up, camera.field_of_view)


def test_an_empty_world_is_white_and_as_far_as_the_camera_sees() -> None:
    rgb, depth = cast(ABOVE, [])
    assert (rgb == 255).all()
    assert (depth == ABOVE.far).all()
    assert rgb.shape == (48, 64, 3)
    assert depth.dtype == np.float32


@pytest.mark.parametrize("camera", [ABOVE, OBLIQUE])
def test_the_points_of_a_floor_are_on_the_floor(camera: Camera) -> None:
    _, depth = cast(camera, [FLOOR])
    near = depth < camera.far
    assert np.abs(points_of(camera, depth)[near][:, 2]).max() < 1e-5
    assert near.mean() > 0.5


@settings(max_examples=25)
@given(st.floats(0.3, 0.7), st.floats(0.0, 0.4), st.floats(0.0, pi))
def test_the_points_of_a_box_are_on_it_and_in_its_place(x: float, y: float, yaw: float) -> None:
    solid = put(box((0.2, 0.1, 0.3), RED), x, y, 0.15, yaw=yaw)
    rgb, depth = cast(OBLIQUE, [FLOOR, solid])
    on_box = (rgb[:, :, 0] > 1.5 * rgb[:, :, 2].astype(float)) & (depth < OBLIQUE.far)
    away = points_of(OBLIQUE, depth)[on_box] - np.array((x, y, 0.15))
    c, s = np.cos(yaw), np.sin(yaw)
    u, v = away[:, 0] * c + away[:, 1] * s, away[:, 1] * c - away[:, 0] * s
    outside = np.maximum.reduce([np.abs(u) - 0.1, np.abs(v) - 0.05, np.abs(away[:, 2]) - 0.15])
    assert len(outside) > 20
    assert np.abs(outside).max() < 1e-5


def test_the_nearer_solid_hides_the_other_in_any_order() -> None:
    low, high = put(box((0.4, 0.4, 0.1), RED), 0.5, 0.2, 0.1), put(box((0.1, 0.1, 0.1), BLUE), 0.5, 0.2, 0.5)
    one, other = cast(ABOVE, [low, high]), cast(ABOVE, [high, low])
    assert (one[0] == other[0]).all()
    assert (one[1] == other[1]).all()
    assert one[1][24, 32] == pytest.approx(2.0 - 0.55, abs=1e-6)
    assert one[0][24, 32].tolist()[2] > one[0][24, 32].tolist()[0]


def test_a_sphere_is_met_at_its_surface() -> None:
    _, depth = cast(ABOVE, [put(sphere(0.3, RED), 0.5, 0.2, 0.4)])
    hit = depth < ABOVE.far
    away = points_of(ABOVE, depth)[hit] - np.array((0.5, 0.2, 0.4))
    assert np.linalg.norm(away, axis=1) == pytest.approx(0.3, abs=1e-4)
    assert hit.sum() > 100


def test_solids_behind_the_camera_or_around_it_are_not_seen() -> None:
    around = put(box((1.0, 1.0, 1.0), RED), 0.5, 0.2, 2.0)
    behind = put(cylinder(0.3, 0.3, BLUE), 0.5, 0.2, 3.0)
    assert (cast(ABOVE, [around, behind])[1] == ABOVE.far).all()


def test_a_floor_that_begins_behind_the_camera_is_seen_ahead() -> None:
    level = Camera((0.0, 0.0, 1.0), (1.0, 0.0, 1.0), width=32, height=24)
    _, depth = cast(level, [FLOOR])
    assert (depth[:11] == level.far).all()
    assert (depth[-1] < 3.0).all()


def test_colours_keep_their_ratios_in_any_light() -> None:
    rgb, depth = cast(OBLIQUE, [put(cylinder(0.2, 0.4, RED), 0.5, 0.2, 0.2)])
    seen = rgb[depth < OBLIQUE.far].astype(float)
    assert len({tuple(one) for one in seen.tolist()}) > 3
    assert seen[:, 0] / seen[:, 1] == pytest.approx(8.0, rel=0.08)


def test_a_picture_on_a_surface_is_seen_where_nothing_hides_it() -> None:
    pixels = np.zeros((2, 3, 3), np.uint8)
    pixels[1, 2] = (0, 250, 0)  # the cell with the greatest x and y
    decal = Decal((0.2, 0.0), (0.8, 0.4), 0.0, pixels)
    lid = put(box((0.1, 0.1, 0.02), RED), 0.7, 0.3, 0.2)
    bare, depth = cast(ABOVE, [FLOOR], [decal])
    at = points_of(ABOVE, depth)
    green = bare[:, :, 1] > 1.5 * bare[:, :, 0].astype(float)
    assert ((at[green][:, 0] > 0.6 - 1e-6) & (at[green][:, 1] > 0.2 - 1e-6)).all()
    assert green.sum() > 20
    covered, _ = cast(ABOVE, [FLOOR, lid], [decal])
    assert (covered[:, :, 1] > 1.5 * covered[:, :, 0].astype(float)).sum() < green.sum()
