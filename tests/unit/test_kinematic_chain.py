"""Frames of a chain of revolute joints, against positions that are known by hand."""

from __future__ import annotations

from math import cos, pi, sin

import pytest

from aeros.kinematic_chain import (
    ORIGIN,
    JointFrame,
    child_frame,
    frames_of,
    mounting_of,
    roll_pitch_yaw,
    zero_angle,
)

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


@pytest.mark.parametrize("zero", [-1.3, 0.4, pi / 2])
def test_a_zero_is_added_to_the_position(zero: float) -> None:
    row = (0.1, -pi / 2, 0.3)
    turned = child_frame(ORIGIN, mounting_of((*row, zero)), 0.2)
    assert turned == child_frame(ORIGIN, mounting_of(row), 0.2 + zero)
    assert zero_angle(row) == 0.0


@pytest.mark.parametrize("alpha", [0.0, pi / 2, -pi / 2, pi, 0.7])
@pytest.mark.parametrize("zero", [0.0, pi / 2, -pi / 2, pi, -1.3])
def test_urdf_turns_as_a_row_does(alpha: float, zero: float) -> None:
    row = (0.0, alpha, 0.0, zero)
    roll, pitch, yaw = roll_pitch_yaw(row)
    # Each single turn is a frame of its own: about x, about y, about z.
    about_x = child_frame(ORIGIN, mounting_of((0.0, roll, 0.0)), 0.0)
    c, s = cos(pitch), sin(pitch)
    about_y = JointFrame((0.0, 0.0, 0.0), (c, 0.0, -s), (0.0, 1.0, 0.0), (s, 0.0, c))
    about_z = child_frame(ORIGIN, mounting_of((0.0, 0.0, 0.0)), yaw)
    frame = child_frame(ORIGIN, mounting_of(row), 0.0)
    for axis, expected in zip(about_x[1:], frame[1:], strict=True):
        assert about_z.rotate_to_base(about_y.rotate_to_base(axis)) == pytest.approx(expected, abs=1e-12)
