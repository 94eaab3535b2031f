"""The robot's own hand in pictures shows a camera's error."""

from __future__ import annotations

from math import radians

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from aeros.perception.own_hand import correct_points, find_level_disc, fit_camera_error

PLACES = [(0.4, -0.25, 0.5), (0.4, 0.25, 0.6), (0.6, 0.2, 0.5), (0.6, -0.2, 0.6), (0.5, 0.0, 0.55)]
SHIFTS = st.tuples(*[st.floats(-0.03, 0.03) for _ in range(3)])


def shown(turn: float, shift: tuple[float, ...]) -> list[tuple[float, float, float]]:
    """Where a camera with that error shows `PLACES`."""
    back = correct_points(np.array(PLACES) - np.array(shift), -turn, (0.0, 0.0, 0.0))
    return [(x, y, z) for x, y, z in back.tolist()]


@given(st.floats(-0.05, 0.05), SHIFTS)
def test_the_error_is_found_from_where_the_hand_is(turn: float, shift: tuple[float, ...]) -> None:
    error = fit_camera_error(shown(turn, shift), PLACES)
    assert error is not None
    assert error.turn == pytest.approx(turn, abs=1e-9)
    assert error.shift == pytest.approx(shift, abs=1e-9)
    assert error.residual == pytest.approx(0.0, abs=1e-9)
    assert error.places == 5


def test_one_wrong_place_is_left_out() -> None:
    seen = shown(radians(1.0), (0.01, 0.0, 0.0))
    seen[2] = (0.3, 0.0, 0.7)
    error = fit_camera_error(seen, PLACES)
    assert error is not None
    assert error.turn == pytest.approx(radians(1.0))
    assert error.places == 4


def test_a_fit_that_explains_nothing_has_a_large_residual() -> None:
    chance = np.random.default_rng(0)
    seen = [(x, y, z) for x, y, z in (np.array(PLACES) + chance.normal(0.0, 0.03, (5, 3))).tolist()]
    error = fit_camera_error(seen, PLACES)
    assert error is not None
    assert error.residual > 0.01


@pytest.mark.parametrize("places", [[], PLACES[:3], [(0.4, 0.0, 0.1 * n) for n in range(5)]])
def test_too_few_places_or_one_above_the_other_fit_no_error(places: list[tuple[float, float, float]]) -> None:
    assert fit_camera_error(places, places) is None


def scene(middle: tuple[float, float], radius: float = 0.035) -> NDArray[np.float64]:
    """A table with a disc at 0.5 m and a wider, lower thing below it, in pixels of 4 mm."""
    x, y = np.meshgrid(np.arange(-0.2, 0.2, 0.004), np.arange(-0.2, 0.2, 0.004))
    away = np.hypot(x - middle[0], y - middle[1])
    z = np.where(away < radius, 0.5, np.where(away < 2.0 * radius, 0.47, 0.0))
    return np.stack((x, y, z), axis=2)


def test_the_middle_of_a_disc_is_found_to_a_pixel() -> None:
    found = find_level_disc(scene((0.02, -0.01)), (0.0, 0.0, 0.49), 0.035, 0.05)
    assert found == pytest.approx((0.02, -0.01, 0.5), abs=0.003)


@pytest.mark.parametrize(
    ("points", "expected"),
    [
        (scene((0.02, 0.0)), (0.0, 0.0, 0.8)),
        (scene((0.02, 0.0), 0.01), (0.0, 0.0, 0.5)),
        (scene((0.19, 0.0)), (0.19, 0.0, 0.5)),
        (scene((0.0, 0.0), 0.3), (0.0, 0.0, 0.5)),
    ],
    ids=["none there", "too small", "cut off", "too large"],
)
def test_a_part_of_a_disc_is_not_found(
    points: NDArray[np.float64], expected: tuple[float, float, float]
) -> None:
    assert find_level_disc(points, expected, 0.035, 0.05) is None
