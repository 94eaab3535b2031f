"""The table's layout, its dirt and what pictures of it show, without a simulator."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.sim.detected_object import DetectedObject
from aeros.sim.geometry import Pose, Vector3, yaw_of, yaw_orientation
from aeros.sim.layouts.table import (
    DirtMap,
    sample_table_layout,
    table_detections,
    table_measurements,
)
from aeros.sim.randomness import RandomSource

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


def test_a_map_of_dirt_has_a_cell_for_each_square_centimetre() -> None:
    dirt = DirtMap((0.0, 0.0), (0.3, 0.2))
    assert dirt.wiped.shape == (20, 30)
    assert dirt.wiped_fraction == 0.0


def test_cells_whose_centres_are_under_the_face_are_wiped() -> None:
    dirt = DirtMap((0.0, 0.0), (0.2, 0.1))
    # A face of 40 mm by 20 mm around (100 mm, 50 mm): centres at 85 ... 115 mm, and at 45 and 55 mm.
    dirt.wipe(Pose((0.1, 0.05, 0.5), yaw_orientation(0.0)), (0.04, 0.02, 1.0))
    expected = np.zeros((10, 20), dtype=bool)
    expected[4:6, 8:12] = True
    assert (dirt.wiped == expected).all()
    assert dirt.wiped_fraction == 8 / 200
    # Turned by a quarter, the length is along y.
    dirt.wipe(Pose((0.1, 0.05, 0.5), yaw_orientation(pi / 2)), (0.04, 0.02, 1.0))
    expected[3:7, 9:11] = True
    assert (dirt.wiped == expected).all()


@pytest.mark.parametrize(("height", "wiped"), [(0.0014, 4), (0.0016, 0), (-0.1, 4)])
def test_a_face_wipes_within_a_millimetre_and_a_half(height: float, wiped: int) -> None:
    dirt = DirtMap((0.0, 0.0), (0.1, 0.1))
    dirt.wipe(Pose((0.05, 0.05, 0.5 + height), yaw_orientation(0.0)), (0.02, 0.02, 1.0))
    assert int(dirt.wiped.sum()) == wiped


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_tilted_face_wipes_where_it_is_low(sign: float) -> None:
    along_x, along_y = DirtMap((0.0, 0.0), (0.2, 0.2)), DirtMap((0.0, 0.0), (0.2, 0.2))
    half = sign * 0.05
    # About y by +0.1 rad, the end at greater x is lower; about x, the end at less y.
    along_x.wipe(Pose((0.1, 0.1, 0.012), (0.0, np.sin(half), 0.0, np.cos(half))), (0.1, 0.1, 0.02))
    along_y.wipe(Pose((0.1, 0.1, 0.012), (np.sin(half), 0.0, 0.0, np.cos(half))), (0.1, 0.1, 0.02))
    assert along_x.wiped[:, :10].any() == (sign < 0)
    assert along_x.wiped[:, 11:].any() == (sign > 0)
    assert along_y.wiped[:9].any() == (sign > 0)
    assert along_y.wiped[11:].any() == (sign < 0)


def test_a_face_is_where_its_pose_is_far_from_the_origin_too() -> None:
    dirt = DirtMap((2.0, 3.0), (2.2, 3.1))
    dirt.wipe(Pose((2.1, 3.05, 0.5), yaw_orientation(0.0)), (0.04, 0.02, 1.0))
    expected = np.zeros((10, 20), dtype=bool)
    expected[4:6, 8:12] = True
    assert (dirt.wiped == expected).all()


@given(st.integers(0, 10_000))
def test_a_table_is_laid_within_its_spreads(seed: int) -> None:
    laid = sample_table_layout(RandomSource(seed))
    assert abs(laid.rest[0] - 0.45) <= 0.03
    assert abs(laid.rest[1] - 0.34) <= 0.03
    assert laid.rest[2] == pytest.approx(0.015)
    assert laid.sponge.position == pytest.approx((laid.rest[0], laid.rest[1], 0.016))
    assert abs(yaw_of(laid.sponge.orientation)) <= 0.1
    for pose, x, z, turn in ((laid.cube, 0.38, 0.021, 0.5), (laid.can, 0.56, 0.026, 1e-9)):
        assert abs(pose.position[0] - x) <= 0.03
        assert abs(pose.position[1] + 0.255) <= 0.03
        assert pose.position[2] == pytest.approx(z)
        assert abs(yaw_of(pose.orientation)) <= turn


def test_each_coordinate_of_a_table_is_drawn_by_itself() -> None:
    tables = [sample_table_layout(RandomSource(seed)) for seed in range(40)]
    assert tables[3] == sample_table_layout(RandomSource(3))
    for one in tables[:5]:
        off = [one.rest[0] - 0.45, one.rest[1] - 0.34, one.cube.position[0] - 0.38]
        off += [one.cube.position[1] + 0.255, one.can.position[0] - 0.56, one.can.position[1] + 0.255]
        assert len({round(part, 6) for part in off}) == 6
    for turns, most in (
        ([yaw_of(one.sponge.orientation) for one in tables], 0.1),
        ([yaw_of(one.cube.orientation) for one in tables], 0.5),
    ):
        assert max(turns) > 0.6 * most
        assert min(turns) < -0.6 * most


@pytest.mark.parametrize(("wiped", "is_wiped"), [(0.0, False), (0.949, False), (0.95, True), (1.0, True)])
def test_a_table_is_wiped_from_95_percent_on(wiped: float, is_wiped: bool) -> None:
    assert table_measurements((0.45, 0.34, 0.015), wiped) == {
        "sponge_rest_position": (0.45, 0.34, 0.015),
        "bin_position": (0.45, -0.5, pytest.approx(0.085)),
        "wiped_fraction": wiped,
        "table_wiped": is_wiped,
    }


REST = (0.45, 0.34, 0.015)
CLEAR: dict[str, Any] = {
    "sponge_seen": True,
    "sponge_position": REST,
    "sponge_yaw": 0.25,
    "clutter_position": None,
    "clutter_yaw": None,
    "clutter_on_table": False,
    "wiping_area_clear": True,
    "table_organized": True,
}


def test_a_table_without_clutter_and_with_the_sponge_at_its_rest_is_organized() -> None:
    assert table_detections(REST, DetectedObject(REST, None, 0.25), []) == CLEAR
    unseen = {"sponge_seen": False, "sponge_position": None, "sponge_yaw": None, "table_organized": False}
    assert table_detections(REST, None, []) == {**CLEAR, **unseen}


@pytest.mark.parametrize(("off", "is_there"), [(0.029, True), (0.031, False)])
def test_a_sponge_is_at_its_rest_within_3_cm(off: float, is_there: bool) -> None:
    sponge = DetectedObject((REST[0] + off, REST[1], REST[2]), None, 0.25)
    assert table_detections(REST, sponge, [])["table_organized"] is is_there


@pytest.mark.parametrize(
    ("place", "in_bin"),
    [
        ((0.45, -0.50, 0.02), True),
        ((0.539, -0.50, 0.02), True),
        ((0.541, -0.50, 0.02), False),
        ((0.361, -0.50, 0.02), True),
        ((0.45, -0.421, 0.02), True),
        ((0.45, -0.419, 0.02), False),
        ((0.45, -0.50, 0.004), False),
        ((0.45, -0.50, 0.084), True),
        ((0.45, -0.50, 0.086), False),
    ],
)
def test_a_piece_in_the_bin_is_no_clutter(place: Vector3, in_bin: bool) -> None:
    seen = table_detections(REST, DetectedObject(REST, None, 0.25), [DetectedObject(place, None, 0.5)])
    assert (seen["clutter_on_table"], seen["table_organized"]) == (not in_bin, in_bin)
    assert (seen["clutter_position"], seen["clutter_yaw"]) == ((None, None) if in_bin else (place, 0.5))


def test_the_first_piece_outside_the_bin_is_the_next_one() -> None:
    places = [(0.45, -0.5, 0.02), (0.38, -0.255, 0.02), (0.56, -0.255, 0.02)]
    assert (
        table_detections(REST, None, [DetectedObject(one) for one in places])["clutter_position"] == places[1]
    )


@pytest.mark.parametrize(
    ("place", "is_clear"),
    [
        ((0.50, 0.0, 0.02), False),
        ((0.291, 0.0, 0.02), False),
        ((0.289, 0.0, 0.02), True),
        ((0.711, 0.0, 0.02), True),
        ((0.50, -0.209, 0.02), False),
        ((0.50, -0.211, 0.02), True),
        ((0.50, 0.211, 0.02), True),
    ],
)
def test_a_piece_within_6_cm_of_the_area_is_in_the_way(place: Vector3, is_clear: bool) -> None:
    assert table_detections(REST, None, [DetectedObject(place)])["wiping_area_clear"] is is_clear
