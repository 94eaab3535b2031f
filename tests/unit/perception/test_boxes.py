"""A box of known size is located on whichever face it rests."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from aeros.perception import locate_box

SIZE = (0.04, 0.03, 0.07)


def top(x: float, y: float, z: float, sides: tuple[float, float], heading: float) -> NDArray[np.float64]:
    """Points on the upper side of a box, 1 mm apart."""
    u, v = np.meshgrid(*(np.arange(-side / 2, side / 2 + 1e-9, 0.001) for side in sides))
    c, s = cos(heading), sin(heading)
    flat = np.full(u.size, z)
    return np.stack((x + u.ravel() * c - v.ravel() * s, y + u.ravel() * s + v.ravel() * c, flat), axis=1)


@given(st.floats(-1.5, 1.5), st.sampled_from([(0, 1), (0, 2), (1, 2)]))
def test_the_upper_side_tells_place_height_and_heading(heading: float, face: tuple[int, int]) -> None:
    sides = (max(SIZE[face[0]], SIZE[face[1]]), min(SIZE[face[0]], SIZE[face[1]]))
    height = sum(SIZE) - sum(sides)
    box = locate_box(top(0.5, -0.2, 0.4 + height, sides, heading), SIZE)
    assert box.position == pytest.approx((0.5, -0.2, 0.4 + height / 2), abs=0.002)
    assert box.height == pytest.approx(height)
    assert box.top == pytest.approx(0.4 + height)
    (along,) = box.headings
    assert abs(sin(along - heading)) < 0.03


def test_a_square_can_be_gripped_two_ways_and_the_smaller_turn_comes_first() -> None:
    box = locate_box(top(0.5, 0.0, 0.05, (0.04, 0.04), 0.5), (0.04, 0.04, 0.05))
    assert box.headings == pytest.approx((0.5, 0.5 - pi / 2), abs=0.02)
    assert box.height == 0.05
