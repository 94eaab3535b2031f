"""Where the robot stands in the room and what pictures show, without a simulator."""

from __future__ import annotations

import pytest

from aeros.sim.detected_object import DetectedObject, Push
from aeros.sim.geometry import Vector3
from aeros.sim.layouts.fetch import (
    STATION_TO_STAND,
    LastDetection,
    camera_measurements,
    room_measurements,
    station_for,
)


def test_a_picture_without_a_possible_push_removes_the_earlier_push() -> None:
    shown = camera_measurements("mast", DetectedObject((0.0, 0.0, 0.0), 1.5, None, None), (0.0, 0.0, 0.0))
    assert shown["object_push_start"] is shown["object_push_way"] is None
    push = Push((0.0, -0.08, 0.0), (0.0, 0.2, 0.0))
    shown = camera_measurements("mast", DetectedObject((0.0, 0.0, 0.0), 1.5, None, push), (0.0, 0.0, 0.0))
    assert (shown["object_push_start"], shown["object_push_way"]) == push
    assert "object_push_way" not in camera_measurements(
        "hand", DetectedObject((0.0, 0.0, 0.0)), (0.0, 0.0, 0.0)
    )


@pytest.mark.parametrize(
    ("place", "before_it"),
    [
        ((1.75, 0.30, 0.0), False),
        ((1.75, 0.36, 0.0), True),
        ((1.60, 0.20, 0.0), True),
        ((1.96, 0.20, 0.0), True),
    ],
)
def test_the_station_moves_to_a_can_seen_out_of_reach_or_far_to_the_side(
    place: tuple[float, float, float], before_it: bool
) -> None:
    station = (1.17, 0.20, 0.3)
    wanted = station_for(station, LastDetection(place, 0.0))
    assert wanted == (pytest.approx((place[0] - STATION_TO_STAND, place[1], 0.3)) if before_it else station)


def test_the_robot_does_not_leave_the_floor_to_reach_a_can() -> None:
    station = (1.17, 0.20, 0.3)
    assert station_for(station, None) == station
    assert station_for(station, LastDetection((9.0, 9.0, 0.0), 0.0)) == (1.6, 0.6, 0.3)
    assert station_for(station, LastDetection((-9.0, -9.0, 0.0), 0.0)) == (-0.5, -1.4, 0.3)


STATION = (1.25, 0.2, 0.3)
CAN = (1.83, 0.2, 0.441)
DELIVERY = (1.7, -1.1, 0.44)


@pytest.mark.parametrize(
    ("seen_at", "held", "time", "is_detected"),
    [
        (None, False, 0.0, False),
        (None, True, 0.0, True),
        (5.0, False, 35.0, True),
        (5.0, False, 35.01, False),
        (5.0, True, 60.0, True),
    ],
)
def test_a_detection_counts_for_half_a_minute_and_a_grip_while_it_lasts(
    seen_at: float | None, held: bool, time: float, is_detected: bool
) -> None:
    seen = None if seen_at is None else LastDetection(CAN, seen_at)
    measured = room_measurements(STATION, (0.0, 0.0, 0.3), held, seen, time)
    assert (measured["object_detected"], measured["object_grasped"]) == (is_detected, held)
    assert measured["station_position"] == STATION


@pytest.mark.parametrize(
    ("base", "is_there"), [((1.25, 0.229, 0.3), True), ((1.25, 0.231, 0.3), False), ((1.25, 0.2, 9.0), True)]
)
def test_the_robot_is_at_its_station_within_3_cm(base: Vector3, is_there: bool) -> None:
    assert room_measurements(STATION, base, False, None, 0.0)["robot_at_target"] is is_there


def test_an_old_detection_moves_no_station() -> None:
    seen = LastDetection((1.60, 0.20, 0.0), 0.0)
    fresh, old = (room_measurements(STATION, (0.0, 0.0, 0.3), False, seen, time) for time in (30.0, 30.1))
    assert fresh["station_position"] == pytest.approx((1.02, 0.20, 0.3))
    assert old["station_position"] == STATION


def test_a_picture_without_the_can_is_no_delivery_and_the_hand_says_nothing() -> None:
    assert camera_measurements("mast", None, DELIVERY) == {"object_delivered": False}
    assert camera_measurements("hand", None, DELIVERY) == {}


def test_the_hand_sees_where_the_can_is_and_how_it_lies() -> None:
    standing = camera_measurements("hand", DetectedObject((1.0, 2.0, 3.0)), DELIVERY)
    assert standing == {"object_position": (1.0, 2.0, 3.0), "object_lying": False}
    lying = camera_measurements("hand", DetectedObject((1.0, 2.0, 3.0), 0.5), DELIVERY)
    assert lying == {"object_position": (1.0, 2.0, 3.0), "object_lying": True, "object_yaw": 0.5}


@pytest.mark.parametrize(
    ("axis", "grip", "free", "yaw"),
    [(None, 0.25, True, 0.25), (None, None, False, 0.0), (0.5, 0.25, True, 0.5), (0.5, None, False, 0.5)],
)
def test_the_mast_sees_if_there_is_room_for_a_hand(
    axis: float | None, grip: float | None, free: bool, yaw: float
) -> None:
    seen = camera_measurements("mast", DetectedObject((0.0, 0.0, 0.0), axis, grip), DELIVERY)
    assert (seen["object_free"], seen["object_yaw"]) == (free, yaw)


@pytest.mark.parametrize(
    ("off", "axis", "is_delivered"),
    [
        ((0.0, 0.0, 0.0), None, True),
        ((0.02, 0.02, 0.0), None, True),
        ((0.022, 0.022, 0.0), None, False),
        ((0.0, 0.0, 0.009), None, True),
        ((0.0, 0.0, 0.011), None, False),
        # A can that lies is 18 mm lower: its radius is 22 mm, half its height 40 mm.
        ((0.0, 0.0, -0.018), 0.5, True),
        ((0.0, 0.0, -0.029), 0.5, False),
        ((0.0, 0.0, 0.0), 0.5, False),
    ],
)
def test_a_can_is_delivered_within_3_cm_and_at_its_height(
    off: Vector3, axis: float | None, is_delivered: bool
) -> None:
    x, y, z = DELIVERY
    found = DetectedObject((x + off[0], y + off[1], z + off[2]), axis)
    assert camera_measurements("mast", found, DELIVERY)["object_delivered"] is is_delivered
