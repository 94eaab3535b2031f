"""Noise of pictures: medians and means of neighbours, and specks."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from numpy.typing import NDArray

from aeros.perception.smoothing import mean_nearby, smooth_colours, without_specks
from tests.unit.perception.test_components import MASKS, drawn


def test_noise_becomes_less_and_an_edge_stays() -> None:
    clean = np.zeros((40, 40, 3))
    clean[:, 20:] = 180.0
    clean += 40.0
    noisy = np.clip(clean + np.random.default_rng(1).normal(0.0, 10.0, clean.shape), 0, 255).astype(np.uint8)
    smooth = smooth_colours(noisy)
    assert smooth.shape == noisy.shape
    assert (smooth - clean).std() < 0.5 * (noisy - clean).std()
    assert ((smooth > 130) == (clean > 130)).all()


def test_specks_are_removed() -> None:
    assert without_specks(drawn("##.#", "....", "###."), 2).tolist() == drawn("##..", "....", "###.").tolist()


@given(MASKS)
def test_no_pixel_is_added(mask: NDArray[np.bool_]) -> None:
    assert not (without_specks(mask, 3) & ~mask).any()
    assert (without_specks(mask, 1) == mask).all()


@given(MASKS)
def test_a_mean_is_that_of_the_pixels_nearby_that_count(mask: NDArray[np.bool_]) -> None:
    values = np.random.default_rng(2).normal(size=mask.shape)
    means, numbers = mean_nearby(values, mask, 2)
    for row, column in np.ndindex(*mask.shape):
        near = np.s_[max(0, row - 2) : row + 3, max(0, column - 2) : column + 3]
        assert numbers[row, column] == mask[near].sum()
        expected = values[near][mask[near]].mean() if mask[near].any() else 0.0
        assert means[row, column] == pytest.approx(expected, abs=1e-9)


def test_the_mean_of_25_pixels_has_a_fifth_of_their_noise() -> None:
    noise = np.random.default_rng(3).normal(0.0, 0.002, (200, 200))
    means, numbers = mean_nearby(noise, np.ones_like(noise, np.bool_), 2)
    assert (numbers[2:-2, 2:-2] == 25).all()
    assert means[2:-2, 2:-2].std() == pytest.approx(0.0004, rel=0.1)
