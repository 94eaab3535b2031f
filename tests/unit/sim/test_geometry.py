"""Points, turns and cameras, worked out by hand."""

from __future__ import annotations

from math import pi, sqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.sim.geometry import (
    UPRIGHT,
    Camera,
    Pose,
    Vector3,
    add,
    cross,
    is_in_view,
    subtract,
    to_frame,
    to_world,
    yaw_of,
    yaw_orientation,
)

ABOUT_X = (sqrt(0.5), 0.0, 0.0, sqrt(0.5))
"""A quarter turn: y becomes z."""

NUMBERS = st.floats(-3.0, 3.0)
VECTORS = st.tuples(NUMBERS, NUMBERS, NUMBERS)


def test_vectors_are_added_subtracted_and_crossed() -> None:
    a, b = (1.0, 2.0, 3.0), (4.0, -6.0, 8.0)
    assert add(a, b) == (5.0, -4.0, 11.0)
    assert subtract(a, b) == (-3.0, 8.0, -5.0)
    assert cross(a, b) == (34.0, 4.0, -14.0)
    assert cross((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)) == (0.0, 0.0, 1.0)


@pytest.mark.parametrize("yaw", [0.0, 0.5, -2.0, pi / 2, 3.0, -3.0])
def test_a_heading_is_read_back(yaw: float) -> None:
    assert yaw_of(yaw_orientation(yaw)) == pytest.approx(yaw)


def test_the_heading_of_a_tilted_body_is_that_of_its_x_axis() -> None:
    assert yaw_of(ABOUT_X) == pytest.approx(0.0)
    # A half turn about the diagonal of x and y swaps them: x points along y.
    assert yaw_of((sqrt(0.5), sqrt(0.5), 0.0, 0.0)) == pytest.approx(pi / 2)
    # A half turn about y: x points back.
    assert yaw_of((0.0, 1.0, 0.0, 0.0)) == pytest.approx(pi)
    # An eighth turn about z, then a quarter about the new x: the heading stays.
    half = pi / 8
    from math import cos, sin

    tilted = (sqrt(0.5) * cos(half), sqrt(0.5) * sin(half), sqrt(0.5) * sin(half), sqrt(0.5) * cos(half))
    assert yaw_of(tilted) == pytest.approx(pi / 4)


def test_a_point_is_turned_and_moved_to_the_world() -> None:
    quarter = Pose((1.0, 2.0, 3.0), yaw_orientation(pi / 2))
    assert to_world(quarter, (1.0, 0.0, 0.5)) == pytest.approx((1.0, 3.0, 3.5))
    assert to_world(Pose((0.0, 0.0, 0.0), ABOUT_X), (1.0, 2.0, 3.0)) == pytest.approx((1.0, -3.0, 2.0))
    assert to_world(Pose((1.0, 1.0, 1.0), UPRIGHT), (1.0, 2.0, 3.0)) == (2.0, 3.0, 4.0)


def test_a_point_is_seen_from_a_frame() -> None:
    quarter = Pose((1.0, 2.0, 3.0), yaw_orientation(pi / 2))
    assert to_frame(quarter, (1.0, 3.0, 3.5)) == pytest.approx((1.0, 0.0, 0.5))
    assert to_frame(Pose((0.0, 0.0, 0.0), ABOUT_X), (1.0, -3.0, 2.0)) == pytest.approx((1.0, 2.0, 3.0))


@given(VECTORS, VECTORS, VECTORS, NUMBERS)
def test_to_a_frame_and_back_is_the_same_point(
    position: Vector3, axis: Vector3, point: Vector3, scalar: float
) -> None:
    length = sqrt(sum(part * part for part in axis) + scalar * scalar)
    if length < 1e-3:
        return
    x, y, z = (part / length for part in axis)
    frame = Pose(position, (x, y, z, scalar / length))
    assert to_world(frame, to_frame(frame, point)) == pytest.approx(point, abs=1e-9)


# A camera at the origin that looks along x; 90 degrees high, twice as wide.

CAMERA = Camera(
    (0.0, 0.0, 0.0), (3.0, 0.0, 0.0), field_of_view=90.0, width=200, height=100, near=0.5, far=4.0
)


@pytest.mark.parametrize(
    ("point", "is_seen"),
    [
        ((2.0, 0.0, 0.0), True),
        ((2.0, 0.0, 1.99), True),
        ((2.0, 0.0, 2.01), False),
        ((2.0, 0.0, -1.99), True),
        ((2.0, 0.0, -2.01), False),
        ((2.0, 3.99, 0.0), True),
        ((2.0, 4.01, 0.0), False),
        ((2.0, -3.99, 0.0), True),
        ((2.0, -4.01, 0.0), False),
        ((0.51, 0.0, 0.0), True),
        ((0.5, 0.0, 0.0), False),
        ((3.99, 0.0, 0.0), True),
        ((4.0, 0.0, 0.0), False),
        ((-2.0, 0.0, 0.0), False),
    ],
)
def test_a_point_is_in_view_up_to_the_pictures_edges(point: Vector3, is_seen: bool) -> None:
    assert is_in_view(CAMERA, point) is is_seen


def test_a_camera_is_anywhere_and_may_look_down() -> None:
    above = Camera((5.0, 6.0, 3.0), (5.0, 6.0, 0.0), up=(1.0, 0.0, 0.0), field_of_view=90.0)
    # 320 by 240 pixels: up to 2 m along x, which is up in the picture, and 2.67 m along y.
    assert is_in_view(above, (6.9, 6.0, 1.0))
    assert not is_in_view(above, (7.1, 6.0, 1.0))
    assert is_in_view(above, (5.0, 8.6, 1.0))
    assert not is_in_view(above, (5.0, 8.7, 1.0))
