"""Plant of which some state variables are measured by sensors on ROS 2 topics."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from aeros.runtime.bus.listened_plant import ListenedPlant
from aeros.runtime.bus.ros2.topic_sensors import TopicReadings, TopicSensor
from aeros.runtime.ports import (
    Monitor,
    MotionCompletion,
    MotionHandle,
    Plant,
    Readings,
    announce_stop,
)


class SensedPlant(ListenedPlant):
    """Plant that behaves as `plant`, with the readings of topic sensors in place of its own.

    Args:
        plant: The wrapped plant.
        sensors: The sensors.
    """

    def __init__(self, plant: Plant, sensors: Sequence[TopicSensor]) -> None:
        super().__init__(plant)
        self._readings = TopicReadings(sensors, is_real_time=self.runs_in_real_time)

    def observe(self) -> Readings:
        """Implement `Plant.observe`."""
        return self._readings.put_into(super().observe(), self.now())

    def advance(self, monitor: Monitor, until: float) -> Mapping[MotionHandle, MotionCompletion]:
        """Implement `Plant.advance`; the monitor gets the topics' readings at every tick."""
        return super().advance(_SensedMonitor(monitor, self._readings), until)


class _SensedMonitor:
    def __init__(self, monitor: Monitor, readings: TopicReadings) -> None:
        self._monitor = monitor
        self._readings = readings

    def __call__(self, now: float, measured: Mapping[str, Any]) -> str | None:
        return self._monitor(now, self._readings.put_into(measured, now))

    def begin_stop(self, reason: str, now: float) -> None:
        announce_stop(self._monitor, reason, now)
