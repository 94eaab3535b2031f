"""The world at one moment after another; of moments in columns, what differs is looked at and no more."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import compress, count
from operator import is_not
from typing import Any, NamedTuple

from aeros.agent.world.values import Kept, UnusableValueError, plain
from aeros.agent.world.world import Stamp, World, is_time, measured_value, measured_world
from aeros.runtime.ports import Moment, Names, Readings
from aeros.spec.model.model import Declared


class _Before(NamedTuple):
    """A moment, all of whose values were of its own time and cannot change, and the world as it showed it."""

    order: Names
    column: tuple[Any, ...]
    world: World


class Measuring:
    """Says what `measured_world` says, of one site's state."""

    def __init__(self, state: Mapping[str, Declared]) -> None:
        self.state = state
        self._exactly = Kept()
        self._before: _Before | None = None

    def world(self, readings: Readings, now: float) -> World:
        """The world as `readings` show it at `now`."""
        if not (
            type(readings) is Moment and is_time(now) and is_time(readings.time) and readings.time == now
        ):
            return measured_world(self.state, readings, now, self._exactly)
        before = self._before
        if before is None or before.order is not readings.order:
            world = measured_world(self.state, readings, now, self._exactly)
        else:
            world = self._since(before, readings, now)
        # A list may hold other values by the next time.
        is_kept = list not in map(type, readings.column)
        self._before = _Before(readings.order, readings.column, world) if is_kept else None
        return world

    def _since(self, before: _Before, moment: Moment, now: float) -> World:
        known, unknown = dict(before.world.known), dict(before.world.unknown)
        predicates = dict(before.world.predicates)
        for place in compress(count(), map(is_not, moment.column, before.column)):
            name = moment.order.names[place]
            declared = self.state.get(name)
            if declared is None:
                continue
            known.pop(name, None)
            unknown.pop(name, None)
            try:
                known[name] = measured_value(declared, moment[name], now, self._exactly)
            except UnusableValueError as error:
                unknown[name] = str(error)
            if name in predicates:
                predicates[name] = plain(known.get(name))
        return World(now, known, unknown, predicates, _stamps(self.state, known, moment.time))


def _stamps(state: Mapping[str, Declared], known: Mapping[str, Any], time: float) -> dict[str, Stamp]:
    """Of what was measured at one time; those of one sensor and age are the same."""
    alike: dict[tuple[str | None, int], Stamp] = {}
    stamps = {}
    for name in known:
        declared = state[name]
        key = declared.sensor, id(declared.max_age)
        stamp = alike.get(key)
        if stamp is None:
            stamp = alike[key] = Stamp(time, declared.sensor, declared.max_age)
        stamps[name] = stamp
    return stamps
