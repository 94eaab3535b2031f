"""What a skill gets to see: state its module may sense, and only while it is fresh."""

from __future__ import annotations

from fractions import Fraction
from math import isfinite
from typing import Any

from aeros.runtime.ports import Readings
from aeros.spec.model import Ecm, Site


def observation_for(ecm: Ecm, site: Site, readings: Readings, now: float) -> dict[str, Any]:
    """Values by vocabulary name, SI, of fresh readings from sensors that `ecm` declares.

    A reading is fresh when it is at most its variable's `max_age` old and not from the future.
    Everything else is left out, which a skill reads as unknown.
    """
    visible: dict[str, Any] = {}
    if not isfinite(now):
        return visible
    sensors = ecm.access.sensors
    for name, declared in site.state.items():
        if declared.sensor in sensors and declared.max_age is not None:
            reading = readings.get(name)
            if reading is not None and (
                reading.time == now or _is_recent(reading.time, now, declared.max_age)
            ):
                visible[name] = reading.value
    return visible


def _is_recent(time: float, now: float, max_age: Fraction) -> bool:
    return isfinite(time) and 0 <= Fraction(now) - Fraction(time) <= max_age
