"""Views of perceivers and their pictures."""

from __future__ import annotations

import numpy as np
import pytest

from aeros.perception import Estimate, Picture, estimate, point_cloud

EYE, TARGET, UP = (0.5, 0.0, 1.0), (0.5, 0.0, 0.0), (1.0, 0.0, 0.0)


def picture(depth: np.ndarray | None) -> Picture:
    return Picture("overhead", 1.5, np.zeros((2, 4, 3), np.uint8), depth, EYE, TARGET, UP, 50.0, (8, 4))


def test_a_picture_knows_its_size_and_the_points_of_its_pixels() -> None:
    depth = np.full((2, 4), 0.9, np.float32)
    one = picture(depth)
    assert (one.width, one.height) == (4, 2)
    assert np.array_equal(one.points(), point_cloud(depth, EYE, TARGET, UP, 50.0, (8, 4)))


def test_a_picture_without_depth_has_no_points_and_says_what_to_declare() -> None:
    with pytest.raises(ValueError, match=r"`overhead` has no depth: ask for it with `depth: true`"):
        picture(None).points()


def test_an_estimate_is_a_value_with_its_uncertainty() -> None:
    assert estimate(0.12, 0.004) == Estimate(value=0.12, uncertainty=0.004)
