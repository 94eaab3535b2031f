"""File of measurements during a run, ten lines per second of plant time, for `aeros top` and `aeros report`.

It is no record: nothing is decided by it, it is not hash-chained, and lines that cannot be written are
counted and left out, because no robot stops for a plot.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from math import inf, isfinite
from os import SEEK_END
from pathlib import Path
from typing import Any, Final, Self

from aeros.files import open_private
from aeros.runtime.bus.message_publisher import RobotChain
from aeros.runtime.ports import Reading, Readings
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import FamilyType, VectorType
from aeros.spec.model.site import Site

FILE: Final = "measured.jsonl"
"""Name of the file in the folder of a run."""

PERIOD: Final = 0.1
"""Minimum time between lines, plant seconds; a changed bool or text is written at once."""

_DIGITS: Final = 6


class SampleWriter:
    """Writer of measurements, as lines `{"time": T, "state": {NAME: [VALUE, MEASURED_AT]}}`; SI.

    Written are all scalar variables, and the other variables that the site's rules read.

    Attributes:
        lost: number of lines that could not be written.

    Args:
        path: the file; lines are appended.
        site: declares state variables and rules.
    """

    def __init__(self, path: Path, site: Site) -> None:
        self.lost = 0
        self._kept = _recorded_variables(site)
        self._last: dict[str, float] = {}
        self._truths: dict[str, Any] = {}
        # A run that is resumed after a crash continues its file on a new line.
        self._file = open_private(path)
        if self._file.tell() > 0:
            self._file.seek(-1, SEEK_END)
            if self._file.read(1) != b"\n":
                self._file.write(b"\n")

    def on_tick(self, now: float, values: Mapping[str, Any], chain: RobotChain) -> None:
        """Implement `MeasurementListener.on_tick`."""
        if now - self._last.get("tick", -inf) >= PERIOD:
            self._last["tick"] = now
            self._write(now, {name: _read(value, now) for name, value in values.items()})

    def on_observed(self, readings: Readings, chain: RobotChain) -> None:
        """Implement `MeasurementListener.on_observed`."""
        state = {name: _read(reading, inf) for name, reading in readings.items()}
        now = max((reading.time for reading in state.values() if isfinite(reading.time)), default=inf)
        truths = {name: one.value for name, one in state.items() if type(one.value) in (bool, str)}
        is_due = now - self._last.get("observed", -inf) >= PERIOD or truths != self._truths
        if isfinite(now) and is_due:
            self._last["observed"], self._truths = now, truths
            self._write(now, state)

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _write(self, now: float, state: Mapping[str, Reading]) -> None:
        written = {
            name: [_to_json(one.value), one.time if isfinite(one.time) else None]
            for name, one in state.items()
            if name in self._kept
        }
        line = json.dumps({"time": now, "state": written}, separators=(",", ":")) + "\n"
        try:
            self._file.write(line.encode())
        except OSError:
            self.lost += 1


def _recorded_variables(site: Site) -> frozenset[str]:
    single = {
        name for name, one in site.state.items() if not isinstance(one.variable.type, FamilyType | VectorType)
    }
    read = {name for rule in site.rules for term in rule.terms.values() for name in t.variables_of(term)}
    return frozenset(single | (read & site.state.keys()))


def _read(value: Any, now: float) -> Reading:
    """Return `value` as a reading with a numeric time; `now` if it has no time of its own."""
    if type(value) is not Reading:
        return Reading(value, now)
    return value if type(value.time) in (float, int) else Reading(value.value, inf)


def _to_json(value: Any) -> Any:
    """Return a value as JSON with six digits; None if it is not a value of the vocabulary."""
    if type(value) in (tuple, list):
        return [_to_json(part) for part in value]
    if type(value) in (bool, str):
        return value
    if type(value) in (float, int) and isfinite(value):
        return float(f"{value:.{_DIGITS}g}")
    return None
