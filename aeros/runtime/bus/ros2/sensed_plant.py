"""Plant of which some state variables are measured by sensors on ROS 2 topics.

Messages come in real time. A simulator that is faster would find each of them too old, so it is slowed down.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
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
        sleep: Waits for some seconds of real time.
    """

    def __init__(
        self, plant: Plant, sensors: Sequence[TopicSensor], sleep: Callable[[float], None] = time.sleep
    ) -> None:
        super().__init__(plant)
        self._readings = TopicReadings(sensors, is_real_time=self.runs_in_real_time)
        self._sleep = sleep

    def observe(self) -> Readings:
        """Implement `Plant.observe`."""
        return self._readings.put_into(super().observe(), self.now())

    def advance(self, monitor: Monitor, until: float) -> Mapping[MotionHandle, MotionCompletion]:
        """Implement `Plant.advance`; the monitor gets the topics' readings at every tick."""
        began = None if self.runs_in_real_time else (self.now(), time.monotonic())

        def time_ahead(now: float) -> float:
            return 0.0 if began is None else (now - began[0]) - (time.monotonic() - began[1])

        def check(now: float, measured: Mapping[str, Any]) -> str | None:
            ahead = time_ahead(now)
            if ahead > 0.0:
                self._sleep(ahead)
            return monitor(now, self._readings.put_into(measured, now))

        ended = super().advance(_SensedMonitor(check, monitor), until)
        now = self.now()
        ahead = time_ahead(now)
        if ahead > 0.0:
            # Nothing moved, so there were no ticks: what comes from here on is not dated to before the wait.
            self._readings.put_into({}, now)
            self._sleep(ahead)
        return ended


class _SensedMonitor:
    """Monitor that checks with `check`; `monitor` is told of stops."""

    def __init__(self, check: Monitor, monitor: Monitor) -> None:
        self._check = check
        self._monitor = monitor

    def __call__(self, now: float, measured: Mapping[str, Any]) -> str | None:
        return self._check(now, measured)

    def begin_stop(self, reason: str, now: float) -> None:
        announce_stop(self._monitor, reason, now)
