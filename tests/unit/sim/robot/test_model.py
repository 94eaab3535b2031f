"""Quantities that are derived from a robot agree with its file."""

from __future__ import annotations

from math import cos, dist, pi, sin

import numpy as np
import pytest

from aeros.kinematic_chain import frames_of
from tests.unit.sim.robot.panda import PANDA, Q_MAX, Q_MIN


def test_solutions_keep_20_mrad_inside_the_limits() -> None:
    assert (PANDA.lowest_solution - Q_MIN) == pytest.approx(0.02)
    assert (Q_MAX - PANDA.highest_solution) == pytest.approx(0.02)


def test_the_constants_of_the_chain_are_those_of_its_rows() -> None:
    assert PANDA.joint_count == len(PANDA.mountings) == 7
    cosines, sines = PANDA.twists
    for place, (length, twist, offset, *_) in enumerate(PANDA.body.dh_rows):
        assert cosines[place, 0] == pytest.approx(cos(twist))
        assert sines[place, 0] == pytest.approx(sin(twist))
        expected = (length, -sin(twist) * offset, cos(twist) * offset)
        assert PANDA.joint_origins[place, 0, :, 0] == pytest.approx(expected)


def test_levers_in_the_ready_posture_are_distances_of_corners_from_axes() -> None:
    q, step = PANDA.postures.ready, 1e-6
    for joint, lever in enumerate(PANDA.ready_levers):
        before, after = (frames_of(PANDA.mountings, (q + x * np.eye(7)[joint]).tolist()) for x in (0.0, step))
        moved = [
            dist(before[hull.joint].to_base(corner), after[hull.joint].to_base(corner)) / step
            for hull in PANDA.body.hulls
            for corner in hull.corners
        ]
        assert max(moved) == pytest.approx(lever, rel=1e-4)


def test_the_hand_is_turned_about_the_last_joints_axis() -> None:
    # Turned by -45 degrees, the hand's y is along (1, 1, 0) of the last joint's frame.
    assert PANDA.hand_rotation @ np.array([0.0, 1.0, 0.0]) == pytest.approx([sin(pi / 4), cos(pi / 4), 0.0])
    tool = frames_of(PANDA.mountings, [0.0] * 7)[-1].to_base(PANDA.body.tool_offset)
    assert tool == pytest.approx((0.088, 0.0, 0.333 + 0.316 + 0.384 - 0.107 - 0.1034))
