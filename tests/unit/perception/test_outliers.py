"""Values far from the median."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from aeros.perception.outliers import inlier_mask


def test_a_value_far_from_the_others_is_an_outlier() -> None:
    values = np.array([1.0, 1.1, 0.9, 1.05, 0.95, 7.0])
    assert inlier_mask(values).tolist() == [True] * 5 + [False]


def test_a_point_is_an_outlier_if_one_of_its_numbers_is() -> None:
    points = np.array([[0.0, 0.1], [0.1, 0.0], [-0.1, 0.1], [0.1, -0.1], [0.0, 9.0]])
    assert inlier_mask(points).tolist() == [True] * 4 + [False]


def test_nearly_equal_values_are_kept_within_the_floor() -> None:
    values = np.array([2.0, 2.0, 2.0, 2.01, 2.5])
    assert inlier_mask(values).tolist() == [True] * 3 + [False] * 2
    assert inlier_mask(values, floor=0.02).tolist() == [True] * 4 + [False]


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=30), st.floats(1.0, 5.0))
def test_half_of_the_values_are_always_inliers(values: list[float], deviations: float) -> None:
    assert inlier_mask(np.array(values), deviations).sum() * 2 >= len(values)
