"""The room's layout, where the robot stands in it and what pictures show, without a simulator."""

from __future__ import annotations

from math import pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.sim.detected_object import DetectedObject, Push
from aeros.sim.geometry import Vector3
from aeros.sim.layouts.fetch import (
    STATION_TO_STAND,
    LastDetection,
    RoomLayout,
    camera_at,
    camera_measurements,
    room_measurements,
    sample_room_layout,
    station_for,
)
from aeros.sim.randomness import RandomSource


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


@given(st.integers(0, 10_000))
def test_a_room_is_drawn_within_its_spreads(seed: int) -> None:
    laid = sample_room_layout(RandomSource(seed))
    x, y, z = laid.station
    assert abs(x - 1.25) <= 0.08
    assert abs(y - 0.20) <= 0.08
    assert z == 0.30
    pick, place = laid.stands
    assert pick == pytest.approx((x + 0.58, y, 0.2))
    # The can stands 1 mm over its stand of 0.4 m, with its middle 40 mm higher.
    assert abs(laid.can[0] - pick[0]) <= 0.05
    assert abs(laid.can[1] - pick[1]) <= 0.12
    assert laid.can[2] == pytest.approx(0.441)
    # The decoy stands on the other side of the stand's middle.
    assert laid.decoy == pytest.approx((pick[0], y - 0.17 if laid.can[1] > y else y + 0.17, 0.426))
    assert abs(laid.delivery[0] - 1.70) <= 0.05
    assert abs(laid.delivery[1] + 1.10) <= 0.05
    assert laid.delivery[2] == pytest.approx(0.44)
    assert place == (laid.delivery[0], laid.delivery[1], 0.2)


def test_each_seed_has_a_room_of_its_own() -> None:
    first, again, other = (sample_room_layout(RandomSource(seed)) for seed in (3, 3, 4))
    assert first == again
    for one, another in zip(first[:4], other[:4], strict=True):
        assert one[:2] != another[:2]
    # Station, can and delivery are drawn each by itself, in x and in y.
    off = [first.station[0] - 1.25, first.station[1] - 0.20]
    off += [first.can[0] - first.station[0] - 0.58, first.can[1] - first.station[1]]
    off += [first.delivery[0] - 1.70, first.delivery[1] + 1.10]
    assert len({round(one, 6) for one in off}) == 6


def test_draws_are_spread_to_both_sides() -> None:
    rooms = [sample_room_layout(RandomSource(seed)) for seed in range(40)]
    for values in zip(*(one.station[:2] for one in rooms), strict=True):
        assert max(values) - min(values) > 0.1


def test_the_cameras_move_with_the_robot() -> None:
    mast = camera_at("mast", (1.0, 2.0, 0.3), (0.0, 0.0, 0.0), 0.0)
    assert mast.eye == pytest.approx((1.05, 2.2, 1.15))
    assert mast.target == pytest.approx((1.58, 2.0, 0.42))
    hand = camera_at("hand", (0.0, 0.0, 0.0), (1.0, 2.0, 0.5), pi / 2)
    assert hand.eye == pytest.approx((1.0, 2.07, 0.56))
    assert hand.target == pytest.approx((1.0, 2.07, -0.44))
    assert hand.up == pytest.approx((0.0, 1.0, 0.0))
    straight = camera_at("hand", (0.0, 0.0, 0.0), (1.0, 2.0, 0.5), 0.0)
    assert straight.eye == pytest.approx((1.07, 2.0, 0.56))
    assert straight.up == pytest.approx((1.0, 0.0, 0.0))
    with pytest.raises(KeyError, match="roof"):
        camera_at("roof", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0)


def test_the_robot_does_not_leave_the_floor_to_reach_a_can() -> None:
    station = (1.17, 0.20, 0.3)
    assert station_for(station, None) == station
    assert station_for(station, LastDetection((9.0, 9.0, 0.0), 0.0)) == (1.6, 0.6, 0.3)
    assert station_for(station, LastDetection((-9.0, -9.0, 0.0), 0.0)) == (-0.5, -1.4, 0.3)


ROOM = RoomLayout(
    (1.25, 0.2, 0.3), (1.83, 0.2, 0.441), (1.83, 0.37, 0.426), (1.7, -1.1, 0.44), ((0.0,) * 3,) * 2
)


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
    seen = None if seen_at is None else LastDetection(ROOM.can, seen_at)
    measured = room_measurements(ROOM, (0.0, 0.0, 0.3), held, seen, time)
    assert (measured["object_detected"], measured["object_grasped"]) == (is_detected, held)
    assert (measured["station_position"], measured["delivery_position"]) == (ROOM.station, ROOM.delivery)


@pytest.mark.parametrize(
    ("base", "is_there"), [((1.25, 0.229, 0.3), True), ((1.25, 0.231, 0.3), False), ((1.25, 0.2, 9.0), True)]
)
def test_the_robot_is_at_its_station_within_3_cm(base: Vector3, is_there: bool) -> None:
    assert room_measurements(ROOM, base, False, None, 0.0)["robot_at_target"] is is_there


def test_an_old_detection_moves_no_station() -> None:
    seen = LastDetection((1.60, 0.20, 0.0), 0.0)
    fresh, old = (room_measurements(ROOM, (0.0, 0.0, 0.3), False, seen, time) for time in (30.0, 30.1))
    assert fresh["station_position"] == pytest.approx((1.02, 0.20, 0.3))
    assert old["station_position"] == ROOM.station


def test_a_picture_without_the_can_is_no_delivery_and_the_hand_says_nothing() -> None:
    assert camera_measurements("mast", None, ROOM.delivery) == {"object_delivered": False}
    assert camera_measurements("hand", None, ROOM.delivery) == {}


def test_the_hand_sees_where_the_can_is_and_how_it_lies() -> None:
    standing = camera_measurements("hand", DetectedObject((1.0, 2.0, 3.0)), ROOM.delivery)
    assert standing == {"object_position": (1.0, 2.0, 3.0), "object_lying": False}
    lying = camera_measurements("hand", DetectedObject((1.0, 2.0, 3.0), 0.5), ROOM.delivery)
    assert lying == {"object_position": (1.0, 2.0, 3.0), "object_lying": True, "object_yaw": 0.5}


@pytest.mark.parametrize(
    ("axis", "grip", "free", "yaw"),
    [(None, 0.25, True, 0.25), (None, None, False, 0.0), (0.5, 0.25, True, 0.5), (0.5, None, False, 0.5)],
)
def test_the_mast_sees_if_there_is_room_for_a_hand(
    axis: float | None, grip: float | None, free: bool, yaw: float
) -> None:
    seen = camera_measurements("mast", DetectedObject((0.0, 0.0, 0.0), axis, grip), ROOM.delivery)
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
    x, y, z = ROOM.delivery
    found = DetectedObject((x + off[0], y + off[1], z + off[2]), axis)
    assert camera_measurements("mast", found, ROOM.delivery)["object_delivered"] is is_delivered
