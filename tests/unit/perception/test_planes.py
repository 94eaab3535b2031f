"""Planes through points."""

from __future__ import annotations

from math import cos, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from aeros.perception.planes import find_plane, fit_plane, trim_to_plane


def face(tilt: float, count: int = 6) -> NDArray[np.float64]:
    """Points on a square of 0.2 m around (1, 2, 0.3), turned about y."""
    u, v = (part.ravel() for part in np.meshgrid(*2 * [np.linspace(-0.1, 0.1, count)]))
    return np.column_stack((1.0 + u * cos(tilt), 2.0 + v, 0.3 - u * sin(tilt)))


@given(st.floats(-1.4, 1.4))
def test_a_plane_goes_through_its_points(tilt: float) -> None:
    plane = fit_plane(face(tilt))
    assert plane.middle == pytest.approx((1.0, 2.0, 0.3))
    assert plane.normal == pytest.approx((sin(tilt), 0.0, cos(tilt)), abs=1e-9)
    assert plane.spread == pytest.approx(0.0, abs=1e-9)
    assert plane.height_at(1.0 + 0.05 * cos(tilt), 2.1) == pytest.approx(0.3 - 0.05 * sin(tilt))


def test_the_spread_is_the_distance_of_the_points() -> None:
    flat = face(0.0)
    flat[:, 2] += np.where(np.arange(len(flat)) % 2, 0.001, -0.001)
    assert fit_plane(flat).spread == pytest.approx(0.001, rel=0.05)


def test_a_vertical_plane_has_no_height_but_a_bounded_one() -> None:
    upright = np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 1.0]])
    assert abs(fit_plane(upright).height_at(0.1, 0.0)) <= 0.5 + 10.0 * 0.1


def test_points_on_the_sides_are_trimmed() -> None:
    side = np.column_stack((np.full(5, 1.1), np.linspace(1.9, 2.1, 5), np.linspace(0.2, 0.28, 5)))
    plane, points = trim_to_plane(np.concatenate((face(0.0), side)), 0.02, 10)
    assert 30 <= len(points) <= 37
    assert points[:, 2].min() > 0.27
    assert plane.normal[2] > 0.99


def test_points_are_not_trimmed_below_the_least_number() -> None:
    scattered = np.random.default_rng(1).uniform(size=(30, 3))
    plane, points = trim_to_plane(scattered, 1e-6, 25)
    assert len(points) == 30
    assert plane == fit_plane(scattered)


@given(st.integers(0, 50), st.floats(-1.0, 1.0))
def test_the_plane_of_most_points_is_found_among_others_and_always_the_same(seed: int, tilt: float) -> None:
    others = np.random.default_rng(seed).uniform((0.5, 1.5, 0.0), (1.5, 2.5, 1.0), size=(25, 3))
    points = np.concatenate((others, face(tilt)))
    found = find_plane(points, 0.001)
    assert found is not None
    plane, mask = found
    assert plane.normal == pytest.approx((sin(tilt), 0.0, cos(tilt)), abs=0.02)
    assert mask[25:].all()
    again = find_plane(points, 0.001)
    assert again is not None
    assert again[0] == plane
    assert np.array_equal(again[1], mask)


@pytest.mark.parametrize("points", [np.zeros((0, 3)), np.zeros((2, 3)), np.outer(np.arange(5.0), np.ones(3))])
def test_points_in_a_line_span_no_plane(points: NDArray[np.float64]) -> None:
    assert find_plane(points, 0.01) is None
