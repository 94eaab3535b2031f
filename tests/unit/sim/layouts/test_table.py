"""The table's layout, its dirt and what pictures of it show, without a simulator."""

from __future__ import annotations

import pytest

from aeros.sim.geometry import Pose, yaw_orientation
from aeros.sim.layouts.table import DirtMap

SPONGE = (0.10, 0.07, 0.03)
"""Edges of a box to wipe with, m."""


def test_only_cells_under_the_wiping_face_are_wiped() -> None:
    dirt = DirtMap((0.0, 0.0), (0.2, 0.2))
    dirt.wipe(Pose((0.1, 0.1, 0.015), yaw_orientation(0.0)), SPONGE)
    assert dirt.wiped_fraction == pytest.approx(0.10 * 0.06 / 0.04, abs=0.031)
    dirt.wipe(Pose((0.1, 0.1, 0.015), yaw_orientation(0.0)), SPONGE)
    assert dirt.wiped_fraction == pytest.approx(0.10 * 0.06 / 0.04, abs=0.031)


def test_a_face_higher_than_the_gap_wipes_nothing_and_a_tilted_one_wipes_at_its_low_edge() -> None:
    dirt = DirtMap((0.0, 0.0), (0.2, 0.2))
    dirt.wipe(Pose((0.1, 0.1, 0.017), yaw_orientation(0.0)), SPONGE)
    assert dirt.wiped_fraction == 0.0
    tilt = 0.1
    dirt.wipe(Pose((0.1, 0.1, 0.015 + 0.05 * tilt), (0.0, tilt / 2.0, 0.0, 1.0)), SPONGE)
    assert 0.0 < dirt.wiped_fraction < 0.05
