"""Incremental world snapshots: re-evaluate only the values that changed since the previous snapshot."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import compress, count
from operator import is_not
from typing import Any, NamedTuple

from aeros.agent.world.values import CachingConverter, UnusableValueError, to_json_value
from aeros.agent.world.world import (
    MeasurementStamp,
    WorldModel,
    is_finite_time,
    value_from_reading,
    world_from_readings,
)
from aeros.runtime.ports import ColumnNames, Readings, Snapshot
from aeros.spec.model.variables import Declared


class _PreviousSnapshot(NamedTuple):
    """A snapshot whose values all had its own time and cannot change, with the world made from it."""

    columns: ColumnNames
    values: tuple[Any, ...]
    world: WorldModel


class IncrementalWorld:
    """Maker of worlds of one site's state, equal to those of `world_from_readings`."""

    def __init__(self, state: Mapping[str, Declared]) -> None:
        self.state = state
        self._exactly = CachingConverter()
        self._before: _PreviousSnapshot | None = None

    def world(self, readings: Readings, now: float) -> WorldModel:
        """Make the world from readings as `world_from_readings` does.

        Args:
            readings: value (SI) and plant time (s) of state variables, by name.
            now: plant time (s).

        Returns:
            The world at `now`.
        """
        if not (
            type(readings) is Snapshot
            and is_finite_time(now)
            and is_finite_time(readings.time)
            and readings.time == now
        ):
            return world_from_readings(self.state, readings, now, self._exactly)
        before = self._before
        if before is None or before.columns is not readings.order:
            world = world_from_readings(self.state, readings, now, self._exactly)
        else:
            world = self._update(before, readings, now)
        # A list may hold other values by the next time.
        is_kept = list not in map(type, readings.column)
        self._before = _PreviousSnapshot(readings.order, readings.column, world) if is_kept else None
        return world

    def _update(self, before: _PreviousSnapshot, snapshot: Snapshot, now: float) -> WorldModel:
        known, unknown = dict(before.world.known), dict(before.world.unknown)
        predicates = dict(before.world.predicates)
        for place in compress(count(), map(is_not, snapshot.column, before.values)):
            name = snapshot.order.names[place]
            declared = self.state.get(name)
            if declared is None:
                continue
            known.pop(name, None)
            unknown.pop(name, None)
            try:
                known[name] = value_from_reading(declared, snapshot[name], now, self._exactly)
            except UnusableValueError as error:
                unknown[name] = str(error)
            if name in predicates:
                predicates[name] = to_json_value(known.get(name))
        return WorldModel(now, known, unknown, predicates, _stamps(self.state, known, snapshot.time))


def _stamps(
    state: Mapping[str, Declared], known: Mapping[str, Any], time: float
) -> dict[str, MeasurementStamp]:
    """Make the stamps of values measured at one time; values of one sensor and maximum age share a stamp."""
    alike: dict[tuple[str | None, int], MeasurementStamp] = {}
    stamps = {}
    for name in known:
        declared = state[name]
        key = declared.sensor, id(declared.max_age)
        stamp = alike.get(key)
        if stamp is None:
            stamp = alike[key] = MeasurementStamp(time, declared.sensor, declared.max_age)
        stamps[name] = stamp
    return stamps
