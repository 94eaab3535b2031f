"""Noise of pictures: medians of neighbours, and specks."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from numpy.typing import NDArray

from aeros.perception.smoothing import smooth_colours, without_specks
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
