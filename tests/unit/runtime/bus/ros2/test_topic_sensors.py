"""A topic's values are dated no later than their measurement, and grow old while nothing certain arrives."""

from __future__ import annotations

from math import inf, nan
from types import SimpleNamespace
from typing import Any

import pytest

from aeros.runtime.bus.ros2.topic_sensors import SAMPLERS, TopicReadings, TopicSensor
from aeros.runtime.ports import Reading

RANGE, SCAN, NUMBER = "sensor_msgs/msg/Range", "sensor_msgs/msg/LaserScan", "std_msgs/msg/Float64"


def header(stamp: float) -> Any:
    return SimpleNamespace(stamp=SimpleNamespace(sec=int(stamp), nanosec=round((stamp % 1) * 1e9)))


def range_message(value: float, stamp: float = 100.0) -> Any:
    return SimpleNamespace(header=header(stamp), range=value, min_range=0.1, max_range=8.0)


def scan(*beams: float) -> Any:
    return SimpleNamespace(header=header(100.0), ranges=beams, range_min=0.1, range_max=8.0)


class Wall:
    """A clock that is set."""

    def __init__(self) -> None:
        self.seconds = 0.0

    def __call__(self) -> float:
        return self.seconds


@pytest.mark.parametrize(
    ("message", "ros", "value"),
    [
        (range_message(1.5), RANGE, 1.5),
        (range_message(inf), RANGE, 8.0),
        (range_message(-inf), RANGE, 0.0),
        (range_message(nan), RANGE, None),
        (range_message(8.5), RANGE, None),
        (range_message(0.05), RANGE, None),
        (scan(3.0, 2.0, inf), SCAN, 2.0),
        (scan(3.0, nan), SCAN, None),
        (scan(), SCAN, None),
        (SimpleNamespace(data=4.0), NUMBER, 4.0),
        (SimpleNamespace(data=nan), NUMBER, None),
        (SimpleNamespace(data=inf), NUMBER, None),
    ],
)
def test_a_message_gives_the_nearest_distance_or_nothing(message: Any, ros: str, value: float | None) -> None:
    assert SAMPLERS[ros](message).value == value


def test_without_a_message_the_variable_is_unknown_though_the_plant_measures_it() -> None:
    readings = TopicReadings([TopicSensor("d", "/d", RANGE, Wall())], is_real_time=True)
    assert readings.put_into({"d": 20.0, "q": 1.0}, 5.0) == {"q": 1.0}


def test_on_a_plant_in_real_time_a_reading_has_the_age_of_its_measurement() -> None:
    wall = Wall()
    sensor = TopicSensor("d", "/d", RANGE, wall)
    sensor.receive(range_message(1.5, stamp=100.0), now=100.02)
    wall.seconds = 0.03
    readings = TopicReadings([sensor], is_real_time=True)
    ((value, time),) = readings.put_into({}, 7.0).values()
    assert (value, time) == (1.5, pytest.approx(6.95))


def test_on_a_simulator_a_reading_is_dated_to_the_look_before_it_came() -> None:
    sensor = TopicSensor("d", "/d", RANGE, Wall())
    readings = TopicReadings([sensor], is_real_time=False)
    readings.put_into({}, 4.0)
    sensor.receive(range_message(1.5, stamp=100.0), now=100.02)
    assert readings.put_into({}, 7.0) == {"d": Reading(1.5, 4.0 - (100.02 - 100.0))}


def test_on_a_slow_simulator_a_reading_is_as_old_as_on_this_machine() -> None:
    wall = Wall()
    sensor = TopicSensor("d", "/d", RANGE, wall)
    readings = TopicReadings([sensor], is_real_time=False)
    readings.put_into({}, 4.0)
    sensor.receive(range_message(1.5), now=100.0)
    wall.seconds = 2.0
    assert readings.put_into({}, 4.1) == {"d": Reading(1.5, 4.1 - 2.0)}


def test_a_sensor_that_falls_silent_keeps_its_old_reading() -> None:
    sensor = TopicSensor("d", "/d", RANGE, Wall())
    readings = TopicReadings([sensor], is_real_time=False)
    sensor.receive(range_message(1.5), now=100.0)
    first = readings.put_into({}, 1.0)
    sensor.receive(range_message(nan), now=100.5)
    assert readings.put_into({}, 9.0) == first


@pytest.mark.parametrize("ahead", [0.5, 3600.0])
def test_a_message_from_the_future_is_ignored(ahead: float) -> None:
    sensor = TopicSensor("d", "/d", RANGE, Wall())
    sensor.receive(range_message(1.5, stamp=100.0 + ahead), now=100.0)
    assert sensor.reading(1.0, 1.0, is_real_time=False) is None


def test_clocks_that_differ_by_a_tick_make_no_reading_of_the_future() -> None:
    sensor = TopicSensor("d", "/d", RANGE, Wall())
    sensor.receive(range_message(1.5, stamp=100.005), now=100.0)
    reading = sensor.reading(1.0, 1.0, is_real_time=True)
    assert reading == Reading(1.5, 1.0)
