"""Sensors whose values come from ROS 2 topics: a distance as `Range`, `LaserScan` or `Float64`.

A message that says nothing certain gives no reading, so the last one grows old until the gate refuses it:
values that are not numbers, ranges outside the sensor's own limits, and time stamps from the future.
Source of the special values: REP 117 (+Inf: nothing within range; -Inf: too near to measure).
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Mapping
from math import inf, isfinite, isnan
from types import MappingProxyType
from typing import Any, Final, NamedTuple

from aeros.runtime.ports import Reading

_FUTURE_TOLERANCE_S: Final = 0.01
"""Greatest time by which a stamp may be ahead of this node's clock: clocks are compared in ticks, s."""


class TopicSample(NamedTuple):
    """Value of a message.

    Attributes:
        value: Distance, m; None if the message says nothing certain.
        stamp: Time of the measurement on the clock of ROS 2, s; None if the message has none.
    """

    value: float | None
    stamp: float | None


def _stamp(message: Any) -> float:
    stamp = message.header.stamp
    return float(stamp.sec) + 1e-9 * float(stamp.nanosec)


def _distance(value: float, least: float, greatest: float) -> float | None:
    """Return a measured range as a distance from which on there may be something; None if it is invalid."""
    if value == inf:
        return greatest if isfinite(greatest) else None
    if value == -inf:
        return 0.0
    return value if not isnan(value) and least <= value <= greatest else None


def _from_range(message: Any) -> TopicSample:
    return TopicSample(_distance(message.range, message.min_range, message.max_range), _stamp(message))


def _from_scan(message: Any) -> TopicSample:
    """Take the nearest of all beams; one beam without a valid value makes the scan uncertain."""
    beams = [_distance(one, message.range_min, message.range_max) for one in message.ranges]
    known = [one for one in beams if one is not None]
    return TopicSample(min(known) if known and len(known) == len(beams) else None, _stamp(message))


def _from_number(message: Any) -> TopicSample:
    value = float(message.data)
    return TopicSample(value if isfinite(value) else None, None)


SAMPLERS: Final[Mapping[str, Callable[[Any], TopicSample]]] = MappingProxyType(
    {
        "sensor_msgs/msg/Range": _from_range,
        "sensor_msgs/msg/LaserScan": _from_scan,
        "std_msgs/msg/Float64": _from_number,
    }
)
"""Message types of sensors, and the functions that take their values."""


class _Arrival(NamedTuple):
    value: float
    delay: float  # s from the measurement to the arrival
    number: int
    at: float  # s, monotonic


class TopicSensor:
    """Sensor of one state variable; messages arrive in another thread.

    Args:
        variable: Name of the state variable.
        topic: Name of the topic.
        ros: Type of its messages, one of `SAMPLERS`.
        clock: Returns seconds of a clock that never goes back.
    """

    def __init__(self, variable: str, topic: str, ros: str, clock: Callable[[], float]) -> None:
        self.variable = variable
        self.topic = topic
        self.ros = ros
        self._sample = SAMPLERS[ros]
        self._clock = clock
        self._arrived: _Arrival | None = None
        self._reading: tuple[int, Reading] | None = None
        self._lock = threading.Lock()

    def receive(self, message: Any, now: float) -> None:
        """Take the value of a message; a message that says nothing certain is ignored.

        Args:
            message: Message of the sensor's type.
            now: Present time of ROS 2, s.
        """
        value, stamp = self._sample(message)
        delay = 0.0 if stamp is None else now - stamp
        if value is None or delay < -_FUTURE_TOLERANCE_S:
            return
        with self._lock:
            number = 0 if self._arrived is None else self._arrived.number + 1
            self._arrived = _Arrival(value, max(0.0, delay), number, self._clock())

    def reading(self, now: float, before: float, *, is_real_time: bool) -> Reading | None:
        """Return the newest value with a time on the plant's clock that is not later than its measurement.

        The clock of a plant in real time is as fast as this machine's. That of a simulator is not: a message
        that was not there at the last look is dated to that look, or by this machine's clock if that is
        earlier.

        Args:
            now: Plant time, s.
            before: Plant time of the last look, s.
            is_real_time: The plant's clock goes with real time.

        Returns:
            The reading; None if no message has arrived.
        """
        with self._lock:
            arrived = self._arrived
        if arrived is None:
            return None
        if self._reading is None or self._reading[0] != arrived.number:
            seen = now - (self._clock() - arrived.at)
            if not is_real_time:
                seen = min(before, seen)
            self._reading = (arrived.number, Reading(arrived.value, seen - arrived.delay))
        return self._reading[1]


class TopicReadings:
    """Readings of all topic sensors, put in place of a plant's own; used by the thread of the plant.

    Args:
        sensors: The sensors.
        is_real_time: The plant's clock goes with real time.
    """

    def __init__(self, sensors: Iterable[TopicSensor], *, is_real_time: bool) -> None:
        self._sensors = tuple(sensors)
        self._is_real_time = is_real_time
        self._before: float | None = None

    def put_into(self, measured: Mapping[str, Any], now: float) -> dict[str, Any]:
        """Put the sensors' readings in place of measurements of the same names.

        Args:
            measured: Values or readings of the plant, by name.
            now: Plant time, s.

        Returns:
            The measurements; a sensor without a message has none, so its variable is unknown.
        """
        before = now if self._before is None else self._before
        self._before = now
        merged = dict(measured)
        for sensor in self._sensors:
            reading = sensor.reading(now, before, is_real_time=self._is_real_time)
            if reading is None:
                merged.pop(sensor.variable, None)
            else:
                merged[sensor.variable] = reading
        return merged
