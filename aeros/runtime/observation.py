"""What a skill gets to see: state its module may sense, and only while it is fresh."""

from __future__ import annotations

from fractions import Fraction
from math import isfinite
from typing import Any

from aeros.runtime.ports import Reading, Readings
from aeros.spec.model import Declared, Ecm, Site


def observation_for(ecm: Ecm, site: Site, readings: Readings, now: float) -> dict[str, Any]:
    """Values by vocabulary name, SI, of fresh readings from sensors that `ecm` declares.

    A reading is fresh when it is at most its variable's `max_age` old and not from the future.
    Everything else is left out, which a skill reads as unknown.
    """
    visible: dict[str, Any] = {}
    sensors = ecm.access.sensors
    for name, declared in site.state.items():
        if declared.sensor in sensors:
            reading = readings.get(name)
            if reading is not None and _fresh(reading, declared, now):
                visible[name] = reading.value
    return visible


def _fresh(reading: Reading, declared: Declared, now: float) -> bool:
    time = reading.time
    if declared.max_age is None or not isfinite(now):
        return False
    if time == now:
        return True
    if not isfinite(time):
        return False
    return 0 <= Fraction(now) - Fraction(time) <= declared.max_age
