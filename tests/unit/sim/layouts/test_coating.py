"""Coatings are wiped where a face is near, and cameras see the rest."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

from aeros.sim.geometry import Pose, Vector3, yaw_orientation
from aeros.sim.layouts.coating import CoatingMap
from tests.shipped_scenes import shipped_scene

DIRT = shipped_scene("table").coatings["dirt"]

SPONGE = (0.10, 0.07, 0.03)
"""Edges of a box to wipe with, m."""


def coating(low: tuple[float, float], high: tuple[float, float], face: Vector3 = SPONGE) -> CoatingMap:
    return CoatingMap(DIRT._replace(low=low, high=high, face=face))


def test_only_cells_under_the_wiping_face_are_wiped() -> None:
    dirt = coating((0.0, 0.0), (0.2, 0.2))
    dirt.wipe(Pose((0.1, 0.1, 0.015), yaw_orientation(0.0)))
    assert dirt.wiped_share == pytest.approx(0.10 * 0.06 / 0.04, abs=0.031)
    dirt.wipe(Pose((0.1, 0.1, 0.015), yaw_orientation(0.0)))
    assert dirt.wiped_share == pytest.approx(0.10 * 0.06 / 0.04, abs=0.031)


def test_a_face_higher_than_the_gap_wipes_nothing_and_a_tilted_one_wipes_at_its_low_edge() -> None:
    dirt = coating((0.0, 0.0), (0.2, 0.2))
    dirt.wipe(Pose((0.1, 0.1, 0.017), yaw_orientation(0.0)))
    assert dirt.wiped_share == 0.0
    tilt = 0.1
    dirt.wipe(Pose((0.1, 0.1, 0.015 + 0.05 * tilt), (0.0, tilt / 2.0, 0.0, 1.0)))
    assert 0.0 < dirt.wiped_share < 0.05


def test_a_part_has_the_cells_whose_centres_are_in_it() -> None:
    dirt = coating((0.0, 0.0), (0.2, 0.1))
    dirt.wiped[:, :5] = True
    assert dirt.wiped_share_where(lambda point: point[0] < 0.1) == 0.5
    assert dirt.wiped_share_where(lambda point: point[0] > 0.1) == 0.0
    assert dirt.wiped_share_where(lambda point: point[2] > 0.0) == 0.0


def test_a_map_has_a_cell_for_each_square_centimetre() -> None:
    dirt = coating((0.0, 0.0), (0.3, 0.2))
    assert dirt.wiped.shape == (20, 30)
    assert dirt.wiped_share == 0.0


def test_cells_whose_centres_are_under_the_face_are_wiped() -> None:
    dirt = coating((0.0, 0.0), (0.2, 0.1), (0.04, 0.02, 1.0))
    # A face of 40 mm by 20 mm around (100 mm, 50 mm): centres at 85 ... 115 mm, and at 45 and 55 mm.
    dirt.wipe(Pose((0.1, 0.05, 0.5), yaw_orientation(0.0)))
    expected = np.zeros((10, 20), dtype=bool)
    expected[4:6, 8:12] = True
    assert (dirt.wiped == expected).all()
    assert dirt.wiped_share == 8 / 200
    # Turned by a quarter, the length is along y.
    dirt.wipe(Pose((0.1, 0.05, 0.5), yaw_orientation(pi / 2)))
    expected[3:7, 9:11] = True
    assert (dirt.wiped == expected).all()


@pytest.mark.parametrize(("height", "wiped"), [(0.0014, 4), (0.0016, 0), (-0.1, 4)])
def test_a_face_wipes_within_a_millimetre_and_a_half(height: float, wiped: int) -> None:
    dirt = coating((0.0, 0.0), (0.1, 0.1), (0.02, 0.02, 1.0))
    dirt.wipe(Pose((0.05, 0.05, 0.5 + height), yaw_orientation(0.0)))
    assert int(dirt.wiped.sum()) == wiped


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_tilted_face_wipes_where_it_is_low(sign: float) -> None:
    along_x, along_y = (coating((0.0, 0.0), (0.2, 0.2), (0.1, 0.1, 0.02)) for _ in range(2))
    half = sign * 0.05
    # About y by +0.1 rad, the end at greater x is lower; about x, the end at less y.
    along_x.wipe(Pose((0.1, 0.1, 0.012), (0.0, np.sin(half), 0.0, np.cos(half))))
    along_y.wipe(Pose((0.1, 0.1, 0.012), (np.sin(half), 0.0, 0.0, np.cos(half))))
    assert along_x.wiped[:, :10].any() == (sign < 0)
    assert along_x.wiped[:, 11:].any() == (sign > 0)
    assert along_y.wiped[:9].any() == (sign > 0)
    assert along_y.wiped[11:].any() == (sign < 0)


def test_a_face_is_where_its_pose_is_far_from_the_origin_too() -> None:
    dirt = coating((2.0, 3.0), (2.2, 3.1), (0.04, 0.02, 1.0))
    dirt.wipe(Pose((2.1, 3.05, 0.5), yaw_orientation(0.0)))
    expected = np.zeros((10, 20), dtype=bool)
    expected[4:6, 8:12] = True
    assert (dirt.wiped == expected).all()


def test_the_picture_has_the_coating_where_nothing_was_wiped() -> None:
    dirt = coating((0.0, 0.0), (0.1, 0.1))
    dirt.wiped[0, :] = True
    picture = dirt.picture()
    assert picture.shape == (10, 10, 3)
    assert (picture[0] == (199, 179, 148)).all()
    assert (picture[1:] == (90, 76, 64)).all()
