"""The room's layout, where the robot stands in it and what pictures show, without a simulator."""

from __future__ import annotations

import pytest

from aeros.sim.detected_object import DetectedObject, Push
from aeros.sim.layouts.fetch import (
    STATION_TO_STAND,
    LastDetection,
    camera_measurements,
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
