"""Sensor models: noise, resolution, latency and dropout between ground truth and readings.

Only `Sensors` and the referee of an experiment see ground truth; everything that acts or decides sees the
readings. A quantity without a sensor model is measured exactly and without delay.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import inf
from operator import add
from typing import Any, Final, NamedTuple

import numpy as np

from aeros.runtime.ports import CameraPicture, Reading, Readings
from aeros.sim.clock import TICK
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.limits import SCANNER_RANGE as SCANNER_RANGE
from aeros.sim.sensor_model import SensorModel

_SENSOR_RANGES: Final[Mapping[str, tuple[float, float]]] = {
    "human_distance": (0.0, SCANNER_RANGE),
    "tool_speed": (0.0, inf),
    "link_speed": (0.0, inf),
    "tracking_error": (0.0, inf),
    "contact_force": (0.0, inf),
    "finger_gap": (0.0, inf),
    "grip_force": (0.0, inf),
    "base_speed": (0.0, inf),
}
"""Range of readings of an instrument, whatever its noise: a range finder shows no negative distance."""

_FREE: Final = (-inf, inf)


@dataclass(frozen=True, slots=True)
class GroundTruth:
    """True values at a tick; not a mapping, so nothing can take it for readings.

    Attributes:
        tick: number of the tick since the plant started.
        values: values by vocabulary name, SI; of a sensor with a clock of its own, its `Reading`.
    """

    tick: int
    values: Mapping[str, Any]

    @property
    def time(self) -> float:
        """Time on the plant's clock, s."""
        return self.tick * TICK


_NO_READING: Final = GroundTruth(-1, {})


def _as_reading(value: Any, time: float) -> Reading:
    """Return a value that was true at `time`, s; a reading keeps its own time."""
    return value if type(value) is Reading else Reading(value, time)


_BLOCK: Final = 240
"""Ticks whose noise is drawn at once."""

_FLOATS: Final = {float}


class _NoiseBlock(NamedTuple):
    """Noise and bias of `_BLOCK` ticks: its number, the sensor model, and a row for each tick."""

    number: int
    model: SensorModel
    rows: list[list[float]]


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
            self.latest = _as_reading(value, tick * TICK)


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
        self._noise: dict[str, _NoiseBlock] = {}
        self._uniform_blocks: dict[str, tuple[int, list[float]]] = {}

    def needs_sampling(self, names: Iterable[str]) -> bool:
        """Check if sensors need values of every tick.

        Args:
            names: quantities that are not measured at every tick anyway.

        Returns:
            True if one of them has a sensor model that depends on values of earlier ticks.
        """
        models = self.models
        return bool(models) and any(name in models and models[name].needs_history for name in names)

    def sample(self, truth: GroundTruth) -> None:
        """Record the ground truth of a tick; further calls within the same tick change nothing.

        Args:
            truth: true values of this tick.
        """
        if self.models or self._lines:
            for name in self._lines.keys() - self.models.keys():
                del self._lines[name]
            for name, model in self.models.items():
                if name in truth.values and (model.needs_history or name in self._lines):
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
        readings = {name: _as_reading(value, now) for name, value in truth.values.items()}
        for name, model in self.models.items():
            if name not in truth.values:
                continue
            line = self._lines.get(name)
            if line is None:
                readings[name] = _as_reading(self._measure(name, model, truth.tick, truth.values[name]), now)
            elif line.latest is not None:
                readings[name] = line.latest
            else:
                del readings[name]
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
        for name, model in self.models.items():
            if name not in values:
                continue
            line = self._lines.get(name)
            if line is None:
                values[name] = self._measure(name, model, truth.tick, values[name])
                continue
            reading = line.latest
            if reading is None:
                del values[name]
            else:
                values[name] = reading.value if reading.time == now else reading
        return values

    def deliver(self, picture: CameraPicture, tick: int) -> CameraPicture | None:
        """Pass a picture through its camera's sensor model.

        Args:
            picture: what the camera saw.
            tick: number of the tick.

        Returns:
            The picture that arrives; None if it is lost.
        """
        model = self.models.get(picture.camera)
        lost = 0.0 if model is None else model.dropout
        if lost > 0.0 and self._chance.generator(f"lost {picture.camera}", tick).random() < lost:
            return None
        return self.disturb(picture, tick)

    def disturb(self, picture: CameraPicture, tick: int) -> CameraPicture:
        """Add a camera's noise to a picture: to depth along the optical axis, and to colours.

        Args:
            picture: what the camera saw.
            tick: number of the tick.

        Returns:
            The picture that the camera takes.
        """
        model = self.models.get(picture.camera)
        if model is None:
            return picture
        draw = self._chance.generator(f"camera {picture.camera}", tick)
        if model.noise > 0.0 and picture.depth is not None:
            depth = np.frombuffer(picture.depth, np.float32)
            noise = draw.normal(0.0, model.noise, len(depth)).astype(np.float32)
            picture = replace(picture, depth=(depth + noise).tobytes())
        if model.colour_noise > 0.0:
            colours = np.frombuffer(picture.rgb, np.uint8)
            noisy = np.rint(colours + draw.normal(0.0, model.colour_noise, len(colours)))
            picture = replace(picture, rgb=np.clip(noisy, 0, 255).astype(np.uint8).tobytes())
        return picture

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
            first = _as_reading(seen, 0.0)
            return first._replace(time=first.time - model.latency_ticks * TICK)
        if name in self._last.values:
            return _as_reading(self._last.values[name], self._last.time)
        return None

    def _measure(self, name: str, model: SensorModel, tick: int, value: Any) -> Any:
        """Return `value` as a sensor reads it, or `_NO_READING`; drawn by name and tick, so repeatable."""
        if model.dropout > 0.0 and self._uniform(name, tick) < model.dropout:
            return _NO_READING
        kind = type(value)
        if kind is Reading:
            return value._replace(value=self._measure(name, replace(model, dropout=0.0), tick, value.value))
        if kind is float:
            return self._number(name, model, value, 0, self._row(name, model, tick, 1))
        if kind is not tuple:
            return value
        row = self._row(name, model, tick, len(value))
        is_free = (model.lowest, model.highest) == _FREE and name not in _SENSOR_RANGES
        if model.resolution == 0.0 and is_free and set(map(type, value)) == _FLOATS:
            return tuple(map(add, value, row))
        return tuple(
            [
                self._number(name, model, one, place, row) if type(one) is float else one
                for place, one in enumerate(value)
            ]
        )

    def _number(self, name: str, model: SensorModel, value: float, place: int, row: Sequence[float]) -> float:
        shown = value + row[place]
        if model.resolution > 0.0:
            shown = model.resolution * round(shown / model.resolution)
        low, high = _SENSOR_RANGES.get(name, (model.lowest, model.highest))
        return min(high, max(low, shown))

    def _row(self, name: str, model: SensorModel, tick: int, width: int) -> Sequence[float]:
        """Return noise and bias of `width` numbers; drawn in blocks, as generators are slow to make."""
        if model.noise == 0.0 and model.bias == 0.0:
            return (0.0,) * width
        number, place = divmod(tick, _BLOCK)
        block = self._noise.get(name)
        if block is None or block.number != number or block.model is not model or len(block.rows[0]) != width:
            normal = self._chance.generator(f"sensor {name}", number).standard_normal((_BLOCK, width))
            bias = model.bias * self._chance.generator(f"bias {name}").standard_normal(width)
            block = self._noise[name] = _NoiseBlock(number, model, (model.noise * normal + bias).tolist())
        return block.rows[place]

    def _uniform(self, name: str, tick: int) -> float:
        """Return a uniform number of a tick, in [0, 1), drawn in blocks, too."""
        number, place = divmod(tick, _BLOCK)
        block = self._uniform_blocks.get(name)
        if block is None or block[0] != number:
            uniform = self._chance.generator(f"dropout {name}", number).random(_BLOCK)
            block = self._uniform_blocks[name] = (number, uniform.tolist())
        return block[1][place]
