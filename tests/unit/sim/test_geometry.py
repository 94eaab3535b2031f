"""Points and turns, worked out by hand."""

from __future__ import annotations

from math import pi, sqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.sim.geometry import (
    UPRIGHT,
    Pose,
    Vector3,
    add,
    cross,
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
