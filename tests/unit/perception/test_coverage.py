"""The part of a region that pictures have shown, and the volume of things that lie there."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from aeros.perception.coverage import heap_volume, largest_gap, seen_cells

LOW, HIGH = (0.0, -0.1), (0.2, 0.1)


def grid(step: float = 0.004) -> NDArray[np.float64]:
    x, y = np.meshgrid(np.arange(-0.1, 0.3, step), np.arange(-0.2, 0.2, step))
    return np.stack((x.ravel(), y.ravel(), np.zeros(x.size)), axis=1)


def test_a_whole_view_has_no_gap() -> None:
    seen = seen_cells(grid(), LOW, HIGH, 0.02)
    assert seen.shape == (10, 10)
    assert seen.all()
    assert largest_gap(seen) == 0


def test_cells_that_are_hidden_or_outside_are_a_gap() -> None:
    points = grid()
    hidden = (np.abs(points[:, 0] - 0.1) < 0.021) & (np.abs(points[:, 1]) < 0.021)
    assert largest_gap(seen_cells(points[~hidden], LOW, HIGH, 0.02)) == 4
    assert largest_gap(seen_cells(points[points[:, 0] < 0.1], LOW, HIGH, 0.02)) == 50
    assert largest_gap(seen_cells(points[:0], LOW, HIGH, 0.02)) == 100


@pytest.mark.parametrize("height", [0.03, 0.06])
def test_the_volume_of_a_block_is_its_own(height: float) -> None:
    points = grid()
    block = points[(np.abs(points[:, 0]) < 0.02) & (np.abs(points[:, 1]) < 0.03)].copy()
    block[:, 2] = height
    sides = block.copy()
    sides[:, 2] = 0.01
    volume = heap_volume(np.concatenate((block, sides)), 0.005)
    assert volume == pytest.approx(0.04 * 0.06 * height, rel=0.3)


def test_nothing_has_no_volume() -> None:
    assert heap_volume(np.zeros((0, 3)), 0.005) == 0.0
