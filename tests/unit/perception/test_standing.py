"""Heights above a fitted plane, and parts of masks."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from numpy.typing import NDArray

from aeros.perception.planes import Plane
from aeros.perception.standing import erode, find_ground, heights_above, separate_parts
from tests.unit.perception.test_components import MASKS, drawn


def sloped(slope: float, count: int = 20) -> NDArray[np.float64]:
    """Points of a plane that rises along x."""
    x, y = (one.ravel() for one in np.meshgrid(np.linspace(0.0, 1.0, count), np.linspace(0.0, 1.0, count)))
    return np.stack((x, y, slope * x), axis=1)


def test_the_ground_is_the_plane_of_most_points() -> None:
    points = sloped(0.01)
    points[:20, 2] += 0.02
    ground = find_ground(points, 0.004, 100)
    assert ground is not None
    assert heights_above(points, ground)[:20] == pytest.approx(0.02, abs=0.001)
    assert heights_above(points, ground)[20:] == pytest.approx(0.0, abs=0.001)


@pytest.mark.parametrize(("count", "least"), [(99, 100), (2, 0), (0, 0)])
def test_too_few_points_show_no_ground(count: int, least: int) -> None:
    assert find_ground(sloped(0.0)[:count], 0.004, least) is None


def test_heights_are_along_the_normal() -> None:
    plane = Plane((0.0, 0.0, 1.0), (0.0, 0.6, 0.8), 0.0)
    points = np.array([[[5.0, 0.0, 2.0], [0.0, 1.0, 1.0]], [[0.0, 0.0, 1.0], [0.0, 0.0, 0.0]]])
    assert heights_above(points, plane) == pytest.approx(np.array([[0.8, 0.6], [0.0, -0.8]]))


def test_parts_are_components_that_are_large_enough() -> None:
    mask = drawn("##.#", "...#", "#..#")
    assert [part.tolist() for part in separate_parts(mask, 2)] == [
        drawn("##..", "....", "....").tolist(),
        drawn("...#", "...#", "...#").tolist(),
    ]


def test_parts_less_than_three_pixels_wide_are_eroded_away() -> None:
    assert erode(drawn("......", ".###..", ".###.#", ".###.#", ".....#")).tolist() == (
        drawn("......", "......", "..#...", "......", "......").tolist()
    )
    assert not erode(drawn("######", "######")).any()


@given(mask=MASKS)
def test_an_eroded_mask_is_inside_of_the_mask_and_off_its_edge(mask: NDArray[np.bool_]) -> None:
    inner = erode(mask)
    assert not (inner & ~mask).any()
    edge = np.ones_like(mask)
    edge[1:-1, 1:-1] = False
    assert not (inner & edge).any()
