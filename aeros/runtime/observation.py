"""What a skill gets to see: state its module may sense, and only while it is fresh."""

from __future__ import annotations

from fractions import Fraction
from math import isfinite
from typing import Any

from aeros.runtime.ports import Readings
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

    def observation(self, readings: Readings, now: float) -> dict[str, Any]:
        """Values by vocabulary name, SI, of what is sensed, as far as its readings are fresh.

        A reading is fresh when it is at most its variable's `max_age` old and not from the future.
        Everything else is left out, which a skill reads as unknown.
        """
        if not isfinite(now):
            return {}
        return {
            name: reading.value
            for name, max_age in self._sensed
            if (reading := readings.get(name)) is not None
            and (reading.time == now or _is_recent(reading.time, now, max_age))
        }


def _is_recent(time: float, now: float, max_age: Fraction) -> bool:
    return isfinite(time) and 0 <= Fraction(now) - Fraction(time) <= max_age
