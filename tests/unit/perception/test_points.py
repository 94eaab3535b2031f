"""Points of pictures and of samples of them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.perception.points import point_cloud, sample_picture, sampled_columns, sampled_rows

DOWN = ((0.5, 0.0, 2.0), (0.5, 0.0, 0.0), (1.0, 0.0, 0.0), 90.0)
"""A camera 2 m above W that looks straight down; up in the picture is x, right is -y."""


def test_each_pixel_is_at_its_lower_left_corner() -> None:
    points = point_cloud(np.full((2, 4), 2.0), *DOWN)
    assert points.shape == (2, 4, 3)
    assert points[0, 0] == pytest.approx((0.5, 4.0, 0.0))
    assert points[1, 3] == pytest.approx((-1.5, -2.0, 0.0))


def test_depth_of_single_precision_gives_points_of_double_precision() -> None:
    assert point_cloud(np.ones((2, 2), np.float32), *DOWN).dtype == np.float64


@given(
    full=st.tuples(st.integers(1, 40), st.integers(1, 40)),
    share=st.tuples(st.floats(0.01, 1.0), st.floats(0.01, 1.0)),
)
def test_the_points_of_a_sample_are_points_of_the_picture(
    full: tuple[int, int], share: tuple[float, float]
) -> None:
    width, height = (max(1, int(one * part)) for one, part in zip(full, share, strict=True))
    depth = np.arange(1.0, 1.0 + full[0] * full[1], dtype=np.float32).reshape(full[1], full[0])
    whole = point_cloud(depth, *DOWN)
    sampled = np.frombuffer(sample_picture(depth.tobytes(), 4, full, (width, height)), np.float32)
    points = point_cloud(sampled.reshape(height, width), *DOWN, full)
    chosen = whole[sampled_rows(height, full[1])[:, None], sampled_columns(width, full[0])[None, :]]
    assert np.array_equal(points, chosen)


@given(st.integers(1, 300), st.integers(1, 300))
def test_sampled_columns_and_rows_are_in_the_picture_in_order(size: int, full: int) -> None:
    for chosen in (sampled_columns(size, full), sampled_rows(size, full)):
        assert len(chosen) == size
        assert chosen.min() >= 0
        assert chosen.max() < full
        assert (np.diff(chosen) >= (1 if size <= full else 0)).all()


def test_a_whole_picture_is_its_own_sample() -> None:
    pixels = bytes(range(18))
    assert sample_picture(pixels, 3, (3, 2), (3, 2)) is pixels


def test_half_a_picture_has_every_second_column_and_row() -> None:
    pixels = np.arange(16, dtype=np.uint8).reshape(4, 4)
    assert list(sample_picture(pixels.tobytes(), 1, (4, 4), (2, 2))) == [4, 6, 12, 14]
