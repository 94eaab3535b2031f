"""Between what is true and what is measured: noise, latency and dropout of each measured quantity.

Ground truth is for the referee of an experiment and for `Sensors` alone; whoever acts or decides sees
what `Sensors` make of it.  A quantity without a sensor model is measured as it is.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from math import ceil, inf
from typing import Any, Final

from numpy.random import Generator

from aeros.runtime.ports import Reading, Readings
from aeros.sim.clock import TICK
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.limits import SCANNER_RANGE as SCANNER_RANGE
from aeros.spec.diagnostics.errors import MisuseError

_SENSOR_RANGES: Final[Mapping[str, tuple[float, float]]] = {
    "human_distance": (0.0, SCANNER_RANGE),
    "tool_speed": (0.0, inf),
    "link_speed": (0.0, inf),
    "contact_force": (0.0, inf),
    "finger_gap": (0.0, inf),
    "grip_force": (0.0, inf),
    "press_force": (0.0, inf),
    "wiped_fraction": (0.0, 1.0),
}
"""Between which values an instrument reads, whatever its noise: a range finder shows no negative distance."""


@dataclass(frozen=True, slots=True)
class SensorModel:
    """How one quantity is measured; by default as it is.

    noise: standard deviation of each of its numbers, in SI; truth values and words have none.
    step: readings are whole multiples of it, in SI; 0: they are not rounded.
    latency: from when something is true to when its reading arrives, s.
    dropout: probability that what is true at one tick is never read; the last reading stays, and ages.
    """

    noise: float = 0.0
    resolution: float = 0.0
    latency: float = 0.0
    dropout: float = 0.0

    def __post_init__(self) -> None:
        """Raises MisuseError for a model of no sensor."""
        amounts = (self.noise, self.resolution, self.latency, self.dropout)
        if not all(0.0 <= amount < inf for amount in amounts) or self.dropout > 1.0:
            raise MisuseError(f"no sensor is like {self}")

    @property
    def needs_history(self) -> bool:
        """Whether what is read at a tick depends on ticks before."""
        return self.latency > 0.0 or self.dropout > 0.0

    @property
    def latency_ticks(self) -> int:
        """The latency in ticks."""
        return ceil(self.latency / TICK - 1e-9)


@dataclass(frozen=True, slots=True)
class GroundTruth:
    """What is true at a tick, by vocabulary name, SI.  No mapping, so that nothing takes it for readings."""

    tick: int
    values: Mapping[str, Any]

    @property
    def time(self) -> float:
        """Seconds on the plant's clock."""
        return self.tick * TICK


_NO_READING: Final = GroundTruth(-1, {})


@dataclass(slots=True)
class _DelayLine:
    """Readings of one quantity on their way; `latest` is the newest that has arrived."""

    latest: Reading | None
    sampled: int = -1
    in_flight: deque[tuple[int, Any]] = field(default_factory=deque)

    def deliver_until(self, before: int) -> None:
        """Let arrive what was true at tick `before` or earlier; a reading is never older than the last."""
        while self.in_flight and self.in_flight[0][0] <= before:
            tick, value = self.in_flight.popleft()
            self.latest = Reading(value, tick * TICK)


class Sensors:
    """The sensors of one plant.

    models: by vocabulary name; to be changed at any time, as faults come and go.  What was on its way
        when a model changes still arrives, as late as the new one says.
    """

    def __init__(self, seed: int, models: Mapping[str, SensorModel] | None = None) -> None:
        self.models: dict[str, SensorModel] = dict(models or {})
        self._chance = RandomSource(seed)
        self._lines: dict[str, _DelayLine] = {}
        self._last = _NO_READING

    def needs_sampling(self, names: Iterable[str]) -> bool:
        """Whether some other quantity than `names` has to be sampled at every tick."""
        if not self.models:
            return False
        return any(model.needs_history for name, model in self.models.items() if name not in names)

    def sample(self, truth: GroundTruth) -> None:
        """Let them see what is true now; once for each tick, whoever asks again afterwards."""
        if self.models or self._lines:
            for name in self._lines.keys() - self.models.keys():
                del self._lines[name]
            for name, model in self.models.items():
                if name in truth.values:
                    self._sample(name, model, truth)
        self._last = truth

    def read(self, truth: GroundTruth) -> Readings:
        """What is measured now, each value with the time at which it was true."""
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
        """What a monitor gets of `truth`: values where they are as of now, else a `Reading`."""
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

    def read_camera(self, truth: GroundTruth) -> Readings:
        """What comes of a single look, as a camera's, with its noise and dropout; how late is `delay`."""
        readings = {}
        for name, value in truth.values.items():
            model = self.models.get(name)
            seen = value if model is None else self._measure(name, model, truth.tick, value)
            if seen is not _NO_READING:
                readings[name] = Reading(seen, truth.time)
        return readings

    def delay(self, names: Iterable[str]) -> int:
        """Ticks until a look at these quantities has arrived."""
        return max((self.models[name].latency_ticks for name in names if name in self.models), default=0)

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
        """The last reading before the first that a model makes.

        Before its clock began the plant was at rest, so what is true then was true before.
        """
        if truth.tick == 0 and model.dropout < 1.0:
            seen = self._measure(name, replace(model, dropout=0.0), 0, truth.values[name])
            return Reading(seen, -model.latency_ticks * TICK)
        if name in self._last.values:
            return Reading(self._last.values[name], self._last.time)
        return None

    def _measure(self, name: str, model: SensorModel, tick: int, value: Any) -> Any:
        """`value` as an instrument shows it, or `_NO_READING`; drawn by name and tick, so always the same."""
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
