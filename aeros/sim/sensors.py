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
from aeros.sim.randomness import Chance
from aeros.sim.robot.limits import SCANNER_RANGE as SCANNER_RANGE
from aeros.spec.diagnostics.errors import MisuseError

_SPANS: Final[Mapping[str, tuple[float, float]]] = {
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
    step: float = 0.0
    latency: float = 0.0
    dropout: float = 0.0

    def __post_init__(self) -> None:
        """Raises MisuseError for a model of no sensor."""
        amounts = (self.noise, self.step, self.latency, self.dropout)
        if not all(0.0 <= amount < inf for amount in amounts) or self.dropout > 1.0:
            raise MisuseError(f"no sensor is like {self}")

    @property
    def looks_back(self) -> bool:
        """Whether what is read at a tick depends on ticks before."""
        return self.latency > 0.0 or self.dropout > 0.0

    @property
    def delay(self) -> int:
        """The latency in ticks."""
        return ceil(self.latency / TICK - 1e-9)


@dataclass(frozen=True, slots=True)
class Truth:
    """What is true at a tick, by vocabulary name, SI.  No mapping, so that nothing takes it for readings."""

    tick: int
    values: Mapping[str, Any]

    @property
    def time(self) -> float:
        """Seconds on the plant's clock."""
        return self.tick * TICK


_ABSENT: Final = Truth(-1, {})


@dataclass(slots=True)
class _Line:
    """Readings of one quantity on their way; `latest` is the newest that has arrived."""

    latest: Reading | None
    sampled: int = -1
    coming: deque[tuple[int, Any]] = field(default_factory=deque)

    def deliver(self, before: int) -> None:
        """Let arrive what was true at tick `before` or earlier; a reading is never older than the last."""
        while self.coming and self.coming[0][0] <= before:
            tick, value = self.coming.popleft()
            self.latest = Reading(value, tick * TICK)


class Sensors:
    """The sensors of one plant.

    models: by vocabulary name; to be changed at any time, as faults come and go.  What was on its way
        when a model changes still arrives, as late as the new one says.
    """

    def __init__(self, seed: int, models: Mapping[str, SensorModel] | None = None) -> None:
        self.models: dict[str, SensorModel] = dict(models or {})
        self._chance = Chance(seed)
        self._lines: dict[str, _Line] = {}
        self._last = _ABSENT

    def look_back(self, names: Iterable[str]) -> bool:
        """Whether some other quantity than `names` has to be sampled at every tick."""
        if not self.models:
            return False
        return any(model.looks_back for name, model in self.models.items() if name not in names)

    def sample(self, truth: Truth) -> None:
        """Let them see what is true now; once for each tick, whoever asks again afterwards."""
        if self.models or self._lines:
            for name in self._lines.keys() - self.models.keys():
                del self._lines[name]
            for name, model in self.models.items():
                if name in truth.values:
                    self._sample(name, model, truth)
        self._last = truth

    def read(self, truth: Truth) -> Readings:
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

    def values(self, truth: Truth) -> Mapping[str, Any]:
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

    def read_once(self, truth: Truth) -> Readings:
        """What comes of a single look, as a camera's, with its noise and dropout; how late is `delay`."""
        readings = {}
        for name, value in truth.values.items():
            model = self.models.get(name)
            seen = value if model is None else self._seen(name, model, truth.tick, value)
            if seen is not _ABSENT:
                readings[name] = Reading(seen, truth.time)
        return readings

    def delay(self, names: Iterable[str]) -> int:
        """Ticks until a look at these quantities has arrived."""
        return max((self.models[name].delay for name in names if name in self.models), default=0)

    def _sample(self, name: str, model: SensorModel, truth: Truth) -> None:
        line = self._lines.get(name)
        if line is None:
            line = self._lines[name] = _Line(self._before(name, model, truth))
        if truth.tick > line.sampled:
            line.sampled = truth.tick
            seen = self._seen(name, model, truth.tick, truth.values[name])
            if seen is not _ABSENT:
                line.coming.append((truth.tick, seen))
        line.deliver(truth.tick - model.delay)

    def _before(self, name: str, model: SensorModel, truth: Truth) -> Reading | None:
        """The last reading before the first that a model makes.

        Before its clock began the plant was at rest, so what is true then was true before.
        """
        if truth.tick == 0 and model.dropout < 1.0:
            seen = self._seen(name, replace(model, dropout=0.0), 0, truth.values[name])
            return Reading(seen, -model.delay * TICK)
        if name in self._last.values:
            return Reading(self._last.values[name], self._last.time)
        return None

    def _seen(self, name: str, model: SensorModel, tick: int, value: Any) -> Any:
        """`value` as an instrument shows it, or `_ABSENT`; drawn by name and tick, so always the same."""
        if model.dropout == 0.0 and model.noise == 0.0:
            return _shown(name, model, value, None)
        draw = self._chance.on(f"sensor {name}", tick)
        if draw.random() < model.dropout:
            return _ABSENT
        return _shown(name, model, value, draw)


def _shown(name: str, model: SensorModel, value: Any, draw: Generator | None) -> Any:
    if type(value) is tuple:
        return tuple([_shown(name, model, part, draw) for part in value])
    if type(value) is not float:
        return value
    shown = value if draw is None else value + model.noise * float(draw.standard_normal())
    if model.step > 0.0:
        shown = model.step * round(shown / model.step)
    low, high = _SPANS.get(name, (-inf, inf))
    return min(high, max(low, shown))
