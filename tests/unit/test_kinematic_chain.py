"""Frames of a chain of revolute joints, against positions that are known by hand."""

from __future__ import annotations

from math import pi

import pytest

from aeros.kinematic_chain import ORIGIN, child_frame, frames_of, mounting_of

PLANAR = ((0.0, 0.0, 0.0), (0.5, 0.0, 0.0))
"""Two joints about z, half a metre apart."""


def test_a_planar_arm_reaches_where_trigonometry_says() -> None:
    last = frames_of(map(mounting_of, PLANAR), (pi / 2, -pi / 2))[-1]
    assert last.origin == pytest.approx((0.0, 0.5, 0.0))
    assert last.to_base((0.25, 0.0, 0.1)) == pytest.approx((0.25, 0.5, 0.1))


def test_a_twist_tilts_the_axis_and_an_offset_runs_along_it() -> None:
    frame = child_frame(ORIGIN, mounting_of((0.1, -pi / 2, 0.3)), 0.0)
    assert frame.z == pytest.approx((0.0, 1.0, 0.0))
    assert frame.origin == pytest.approx((0.1, 0.3, 0.0))
    assert frame.y == pytest.approx((0.0, 0.0, -1.0))


def test_the_frames_begin_with_the_base_and_need_a_position_for_each_joint() -> None:
    assert frames_of(map(mounting_of, PLANAR), (0.0, 0.0))[0] == ORIGIN
    with pytest.raises(ValueError, match="shorter"):
        frames_of(map(mounting_of, PLANAR), (0.0,))
