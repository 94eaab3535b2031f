"""Rectangles around points, and headings of what looks the same when turned."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from aeros.perception.rectangles import (
    Rectangle,
    has_size,
    min_area_rectangle,
    top_face,
    top_points,
    wrap_heading,
)


def grid(x: float, y: float, heading: float, length: float, width: float) -> NDArray[np.float64]:
    """Points all over a rectangle, its corners among them."""
    u, v = np.meshgrid(np.linspace(-length / 2, length / 2, 7), np.linspace(-width / 2, width / 2, 5))
    turned = np.stack((u * cos(heading) - v * sin(heading), u * sin(heading) + v * cos(heading)), axis=-1)
    return np.asarray(turned.reshape(-1, 2) + np.array((x, y)), np.float64)


@pytest.mark.parametrize("degrees", [0.0, 0.5, 30.0, 45.0, 89.5])
def test_a_rectangle_is_found_to_half_a_degree(degrees: float) -> None:
    found = min_area_rectangle(grid(1.0, -2.0, degrees * pi / 180.0, 0.4, 0.1))
    assert found == pytest.approx((1.0, -2.0, degrees * pi / 180.0, 0.4, 0.1))


def test_a_heading_beyond_a_quarter_turn_makes_the_width_the_longer_side() -> None:
    found = min_area_rectangle(grid(0.0, 0.0, 2.0 * pi / 3.0, 0.4, 0.1))
    assert found == pytest.approx((0.0, 0.0, pi / 6.0, 0.1, 0.4), abs=1e-12)


@pytest.mark.parametrize(
    ("sides", "longer", "shorter"),
    [((0.4, 0.1), 0.2, 0.2 + pi / 2.0), ((0.1, 0.4), 0.2 + pi / 2.0, 0.2), ((0.1, 0.1), 0.2, 0.2 + pi / 2.0)],
)
def test_each_side_has_its_heading_whichever_is_called_the_length(
    sides: tuple[float, float], longer: float, shorter: float
) -> None:
    found = Rectangle(0.0, 0.0, 0.2, *sides)
    assert (found.longer_heading, found.shorter_heading) == (longer, shorter)


def test_one_point_has_no_size() -> None:
    found = min_area_rectangle(np.array([[3.0, 4.0]]))
    assert (found.x, found.y, found.length, found.width) == pytest.approx((3.0, 4.0, 0.0, 0.0))


@given(st.lists(st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)), min_size=1, max_size=9))
def test_every_point_is_within_its_rectangle(points: list[tuple[float, float]]) -> None:
    found = min_area_rectangle(np.array(points))
    c, s = cos(found.heading), sin(found.heading)
    for x, y in points:
        u, v = (x - found.x) * c + (y - found.y) * s, (y - found.y) * c - (x - found.x) * s
        assert abs(u) <= found.length / 2.0 + 1e-9
        assert abs(v) <= found.width / 2.0 + 1e-9


def test_the_top_face_is_of_the_points_within_4_mm_of_the_highest() -> None:
    face = grid(1.0, 2.0, 0.0, 0.2, 0.1)
    tops = np.column_stack((face, np.linspace(0.0965, 0.1, len(face))))
    side = np.column_stack((grid(5.0, 5.0, 0.0, 3.0, 3.0), np.full(35, 0.0955)))
    rectangle, height = top_face(np.concatenate((side, tops)))
    assert rectangle == pytest.approx((1.0, 2.0, 0.0, 0.2, 0.1), abs=1e-12)
    assert height == pytest.approx(0.09825)


@pytest.mark.parametrize(
    ("heading", "period", "wrapped"),
    [
        (0.5, pi, 0.5),
        (2.0, pi, 2.0 - pi),
        (-2.0, pi, pi - 2.0),
        (pi / 2.0, pi, -pi / 2.0),
        (4.0, 2.0 * pi, 4.0 - 2.0 * pi),
        (7.0, pi / 2.0, 7.0 - 2.0 * pi),
    ],
)
def test_a_heading_is_wrapped_around_zero(heading: float, period: float, wrapped: float) -> None:
    assert wrap_heading(heading, period) == pytest.approx(wrapped)


@pytest.mark.parametrize(
    ("length", "width", "expected"),
    [(0.4, 0.1, True), (0.405, 0.095, True), (0.1, 0.4, False), (0.42, 0.1, False)],
)
def test_a_size_is_checked_whichever_side_is_the_length(length: float, width: float, expected: bool) -> None:
    for sides in ((0.4, 0.1), (0.1, 0.4)):
        assert has_size(Rectangle(0.0, 0.0, 0.3, *sides), length, width, 0.006) == expected


def test_the_depth_of_the_top_may_be_chosen() -> None:
    points = np.array([[0.0, 0.0, 0.1], [0.0, 0.0, 0.097], [0.0, 0.0, 0.08]])
    assert len(top_points(points)) == 2
    assert len(top_points(points, 0.03)) == 3


@pytest.mark.parametrize("height", [0.05, 0.3, 2.0])
def test_a_single_wrong_pixel_does_not_decide_where_the_top_is(height: float) -> None:
    x, y = (one.ravel() for one in np.meshgrid(np.linspace(0.0, 0.04, 5), np.linspace(0.0, 0.08, 9)))
    face = np.column_stack((x, y, np.full(len(x), 0.04)))
    wrong = np.array(((0.2, 0.3, height),))
    rectangle, top = top_face(np.concatenate((face, wrong)))
    assert top == pytest.approx(0.04)
    assert sorted((rectangle.length, rectangle.width)) == pytest.approx([0.04, 0.08], abs=1e-6)
    # Of a thing of fewer points each counts.
    assert top_face(np.concatenate((face[:20], wrong)))[1] == pytest.approx(height)
