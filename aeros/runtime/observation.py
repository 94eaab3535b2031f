"""What a skill gets to see: state its module may sense, and only while it is fresh."""

from __future__ import annotations

from fractions import Fraction
from math import isfinite
from typing import Any

from aeros.runtime.ports import Moment, Names, Readings
from aeros.spec.model import Ecm, Site


class Sight:
    """What of the state of `site` a module senses: that of sensors which it declares."""

    def __init__(self, ecm: Ecm, site: Site) -> None:
        self.site = site
        self._sensed = [
            (name, declared.max_age)
            for name, declared in site.state.items()
            if declared.sensor in ecm.access.sensors and declared.max_age is not None
        ]
        self._order: Names | None = None  # of the moments that are seen
        self._sensed_of: list[tuple[str, int]] = []  # names that are sensed, and their places there
        self._column: tuple[Any, ...] = ()  # that was seen last
        self._seen: dict[str, Any] = {}  # of it

    def observation(self, readings: Readings, now: float) -> dict[str, Any]:
        """Values by vocabulary name, SI, of what is sensed, as far as its readings are fresh.

        A reading is fresh when it is at most its variable's `max_age` old and not from the future.
        Everything else is left out, which a skill reads as unknown.
        """
        if not isfinite(now):
            return {}
        if type(readings) is Moment and readings.time == now:
            return self._of_now(readings)
        return {
            name: reading.value
            for name, max_age in self._sensed
            if (reading := readings.get(name)) is not None
            and (reading.time == now or _is_recent(reading.time, now, max_age))
        }

    def _of_now(self, moment: Moment) -> dict[str, Any]:
        """All that is sensed, as it was measured now."""
        if moment.order is not self._order:
            self._order, self._column, places = moment.order, (), moment.order.places
            self._sensed_of = [(name, places[name]) for name, _ in self._sensed if name in places]
        if moment.column is not self._column:
            column = self._column = moment.column
            self._seen = {name: column[place] for name, place in self._sensed_of}
        # A copy, as whoever gets it may change it.
        return dict(self._seen)


def _is_recent(time: float, now: float, max_age: Fraction) -> bool:
    return isfinite(time) and 0 <= Fraction(now) - Fraction(time) <= max_age
