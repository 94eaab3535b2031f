"""Pictures of the table and what they show, without a simulator."""

from __future__ import annotations

from typing import Any

import pytest

from aeros.sim.detected_object import DetectedObject
from aeros.sim.geometry import Vector3
from aeros.sim.layouts.table import (
    table_detections,
    table_measurements,
)


@pytest.mark.parametrize(("wiped", "is_wiped"), [(0.0, False), (0.949, False), (0.95, True), (1.0, True)])
def test_a_table_is_wiped_from_95_percent_on(wiped: float, is_wiped: bool) -> None:
    assert table_measurements(wiped) == {"wiped_fraction": wiped, "table_wiped": is_wiped}


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
