"""Recorder of an episode: the measured state at a constant rate of plant time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, NamedTuple

from aeros.agent.world.values import CachingConverter
from aeros.agent.world.world import WorldModel, world_from_readings
from aeros.runtime.bus.message_publisher import RobotChain
from aeros.runtime.ports import Reading, Readings
from aeros.spec.model.variables import Declared

RATE: Final = 10
"""Frames per second of plant time."""


class EpisodeFrame(NamedTuple):
    """The state at one time.

    Attributes:
        time: plant time, s.
        world: the known values at that time.
    """

    time: float
    world: WorldModel


class EpisodeRecorder:
    """Listener that keeps the state `RATE` times a second; implements `MeasurementListener`.

    A frame holds the newest value of each variable up to its time.  One that is older than the variable's
    greatest age is unknown.

    Args:
        state: declared state variables by name.

    Attributes:
        frames: the frames so far, the first at the time of the first measurement.
    """

    def __init__(self, state: Mapping[str, Declared]) -> None:
        self.frames: list[EpisodeFrame] = []
        self._state = state
        self._latest: dict[str, Reading] = {}
        self._convert = CachingConverter()
        self._start: float | None = None
        self._now = 0.0

    def on_tick(self, now: float, values: Mapping[str, Any], chain: RobotChain) -> None:
        """Implement `MeasurementListener.on_tick`."""
        self._take(
            now,
            {name: one if isinstance(one, Reading) else Reading(one, now) for name, one in values.items()},
        )

    def on_observed(self, readings: Readings, chain: RobotChain) -> None:
        """Implement `MeasurementListener.on_observed`."""
        times = [one.time for one in readings.values() if type(one.time) in (int, float)]
        self._take(max(times, default=self._now), dict(readings))

    def finish(self) -> None:
        """Add the last frames: those up to the newest measurement, and one of it."""
        if self._start is not None:
            self._emit_before(self._now)
            self._add_frame(self._frame_time())

    def _take(self, now: float, readings: Mapping[str, Reading]) -> None:
        if self._start is None:
            self._start = now
        self._emit_before(now)
        self._now = max(self._now, now)
        self._latest.update(readings)

    def _frame_time(self) -> float:
        return (self._start or 0.0) + len(self.frames) / RATE

    def _emit_before(self, now: float) -> None:
        """Add the frames whose time has passed: nothing that is measured later belongs to them."""
        while self._frame_time() < now:
            self._add_frame(self._frame_time())

    def _add_frame(self, time: float) -> None:
        # A value of a later time than the frame was measured in the same instant of a symbolic plant.
        usable = {name: one for name, one in self._latest.items() if one.time <= time}
        self.frames.append(EpisodeFrame(time, world_from_readings(self._state, usable, time, self._convert)))
