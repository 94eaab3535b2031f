"""Sensor models: noise, resolution, latency and dropout between ground truth and readings.

Only `Sensors` and the referee of an experiment see ground truth; everything that acts or decides sees the
readings. A quantity without a sensor model is measured exactly and without delay.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from math import ceil, inf
from typing import Any, Final

import numpy as np
from numpy.random import Generator

from aeros.runtime.ports import CameraPicture, Reading, Readings
from aeros.sim.clock import TICK
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.limits import SCANNER_RANGE as SCANNER_RANGE
from aeros.spec.diagnostics.errors import MisuseError

_SENSOR_RANGES: Final[Mapping[str, tuple[float, float]]] = {
    "human_distance": (0.0, SCANNER_RANGE),
    "tool_speed": (0.0, inf),
    "link_speed": (0.0, inf),
    "tracking_error": (0.0, inf),
    "contact_force": (0.0, inf),
    "finger_gap": (0.0, inf),
    "grip_force": (0.0, inf),
}
"""Range of readings of an instrument, whatever its noise: a range finder shows no negative distance."""


@dataclass(frozen=True, slots=True)
class SensorModel:
    """Errors of one measured quantity; by default none.

    Attributes:
        noise: standard deviation of each of its numbers, SI; booleans and words have no noise.
        resolution: readings are whole multiples of it, SI; 0 means no rounding.
        latency: time from when a value is true to when its reading arrives, s.
        dropout: probability that the value of one tick is never read; the last reading stays and ages.
    """

    noise: float = 0.0
    resolution: float = 0.0
    latency: float = 0.0
    dropout: float = 0.0

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            MisuseError: a number is negative or infinite, or the dropout is above 1.
        """
        amounts = (self.noise, self.resolution, self.latency, self.dropout)
        if not all(0.0 <= amount < inf for amount in amounts) or self.dropout > 1.0:
            raise MisuseError(f"invalid sensor model {self}")

    @property
    def needs_history(self) -> bool:
        """True if a reading depends on values of earlier ticks."""
        return self.latency > 0.0 or self.dropout > 0.0

    @property
    def latency_ticks(self) -> int:
        """The latency in ticks, rounded up."""
        return ceil(self.latency / TICK - 1e-9)


@dataclass(frozen=True, slots=True)
class GroundTruth:
    """True values at a tick; not a mapping, so nothing can take it for readings.

    Attributes:
        tick: number of the tick since the plant started.
        values: values by vocabulary name, SI.
    """

    tick: int
    values: Mapping[str, Any]

    @property
    def time(self) -> float:
        """Time on the plant's clock, s."""
        return self.tick * TICK


_NO_READING: Final = GroundTruth(-1, {})


@dataclass(slots=True)
class _DelayLine:
    """Readings of one quantity that have not arrived yet; `latest` is the newest that has arrived."""

    latest: Reading | None
    sampled: int = -1
    in_flight: deque[tuple[int, Any]] = field(default_factory=deque)

    def deliver_until(self, before: int) -> None:
        """Deliver values that were true at tick `before` or earlier; readings never get older."""
        while self.in_flight and self.in_flight[0][0] <= before:
            tick, value = self.in_flight.popleft()
            self.latest = Reading(value, tick * TICK)


class Sensors:
    """The sensors of one plant.

    Args:
        seed: of noise and dropout.
        models: sensor models by name of the state variable or camera.

    Attributes:
        models: sensor models by name of the state variable or camera. Faults change it at any time; readings
            already under way still arrive, after the latency of the new model.
    """

    def __init__(self, seed: int, models: Mapping[str, SensorModel] | None = None) -> None:
        self.models: dict[str, SensorModel] = dict(models or {})
        self._chance = RandomSource(seed)
        self._lines: dict[str, _DelayLine] = {}
        self._last = _NO_READING

    def needs_sampling(self, names: Iterable[str]) -> bool:
        """Check if sensors need values of every tick.

        Args:
            names: quantities that are sampled anyway.

        Returns:
            True if a quantity other than `names` must be sampled at every tick.
        """
        if not self.models:
            return False
        return any(model.needs_history for name, model in self.models.items() if name not in names)

    def sample(self, truth: GroundTruth) -> None:
        """Record the ground truth of a tick; further calls within the same tick change nothing.

        Args:
            truth: true values of this tick.
        """
        if self.models or self._lines:
            for name in self._lines.keys() - self.models.keys():
                del self._lines[name]
            for name, model in self.models.items():
                if name in truth.values:
                    self._sample(name, model, truth)
        self._last = truth

    def read(self, truth: GroundTruth) -> Readings:
        """Measure the ground truth of now.

        Args:
            truth: true values of this tick.

        Returns:
            A reading of each quantity, with the time at which its value was true; quantities whose first
            reading has not arrived are absent.
        """
        self.sample(truth)
        now = truth.time
        readings = {name: Reading(value, now) for name, value in truth.values.items()}
        for name in self.models:
            readings.pop(name, None)
            line = self._lines.get(name)
            if line is not None and line.latest is not None:
                readings[name] = line.latest
        return readings

    def monitor_values(self, truth: GroundTruth) -> Mapping[str, Any]:
        """Measure the ground truth of now for the monitor.

        Args:
            truth: true values of this tick.

        Returns:
            By vocabulary name: the plain value if it was measured at this tick, else a `Reading`.
        """
        if self.models.keys().isdisjoint(truth.values):
            return truth.values
        self.sample(truth)
        now, values = truth.time, dict(truth.values)
        for name in self.models.keys() & values.keys():
            reading = self._lines[name].latest
            if reading is None:
                del values[name]
            else:
                values[name] = reading.value if reading.time == now else reading
        return values

    def deliver(self, picture: CameraPicture, tick: int) -> CameraPicture | None:
        """Pass a picture through its camera's sensor model: noise is of depth, m, along the optical axis.

        Args:
            picture: what the camera saw.
            tick: number of the tick.

        Returns:
            The picture that arrives; None if it is lost.
        """
        model = self.models.get(picture.camera)
        if model is None or (model.dropout == 0.0 and model.noise == 0.0):
            return picture
        draw = self._chance.generator(f"camera {picture.camera}", tick)
        if draw.random() < model.dropout:
            return None
        if model.noise == 0.0 or picture.depth is None:
            return picture
        depth = np.frombuffer(picture.depth, np.float32)
        noise = draw.normal(0.0, model.noise, len(depth)).astype(np.float32)
        return replace(picture, depth=(depth + noise).tobytes())

    def delay(self, camera: str) -> int:
        """Return the time by which a camera's picture arrives late.

        Args:
            camera: name of the camera.

        Returns:
            The latency, ticks.
        """
        model = self.models.get(camera)
        return 0 if model is None else model.latency_ticks

    def _sample(self, name: str, model: SensorModel, truth: GroundTruth) -> None:
        line = self._lines.get(name)
        if line is None:
            line = self._lines[name] = _DelayLine(self._initial_reading(name, model, truth))
        if truth.tick > line.sampled:
            line.sampled = truth.tick
            seen = self._measure(name, model, truth.tick, truth.values[name])
            if seen is not _NO_READING:
                line.in_flight.append((truth.tick, seen))
        line.deliver_until(truth.tick - model.latency_ticks)

    def _initial_reading(self, name: str, model: SensorModel, truth: GroundTruth) -> Reading | None:
        """Return the reading that comes before the first that a model makes.

        Before its clock started the plant was at rest, so what is true at tick 0 was true before.
        """
        if truth.tick == 0 and model.dropout < 1.0:
            seen = self._measure(name, replace(model, dropout=0.0), 0, truth.values[name])
            return Reading(seen, -model.latency_ticks * TICK)
        if name in self._last.values:
            return Reading(self._last.values[name], self._last.time)
        return None

    def _measure(self, name: str, model: SensorModel, tick: int, value: Any) -> Any:
        """Return `value` as a sensor reads it, or `_NO_READING`; drawn by name and tick, so repeatable."""
        if model.dropout == 0.0 and model.noise == 0.0:
            return _apply_noise(name, model, value, None)
        draw = self._chance.generator(f"sensor {name}", tick)
        if draw.random() < model.dropout:
            return _NO_READING
        return _apply_noise(name, model, value, draw)


def _apply_noise(name: str, model: SensorModel, value: Any, draw: Generator | None) -> Any:
    if type(value) is tuple:
        return tuple([_apply_noise(name, model, part, draw) for part in value])
    if type(value) is not float:
        return value
    shown = value if draw is None else value + model.noise * float(draw.standard_normal())
    if model.resolution > 0.0:
        shown = model.resolution * round(shown / model.resolution)
    low, high = _SENSOR_RANGES.get(name, (-inf, inf))
    return min(high, max(low, shown))
