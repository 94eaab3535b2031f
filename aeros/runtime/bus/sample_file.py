"""File of measurements during a run, ten lines per second of plant time, for `aeros top` and `aeros report`.

It is no record: nothing is decided by it, it is not hash-chained, and lines that cannot be written are
counted and left out, because no robot stops for a plot.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
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

Usage = Callable[[bool], Mapping[str, Any] | None]
"""Returns the use of resources of each module as JSON values; None if it was returned a moment ago.

The argument is True for the last call, which returns it in any case.
"""

_DIGITS: Final = 6


class SampleWriter:
    """Writer of measurements, as lines `{"time": T, "state": {NAME: [VALUE, MEASURED_AT]}}`; SI.

    Some lines have `modules`, too: the use of resources of each.
    Written are all scalar variables, and the other variables that the site's rules read.

    Attributes:
        lost: number of lines that could not be written.

    Args:
        path: the file; lines are appended.
        site: declares state variables and rules.
        usage: returns the use of resources; called with each line, and at the end; None to write none.
    """

    def __init__(self, path: Path, site: Site, usage: Usage | None = None) -> None:
        self.lost = 0
        self._usage = usage
        self._now = 0.0
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
        """Write the use of resources for the last time, and close the file; safe to call twice."""
        if self._usage is not None and not self._file.closed:
            self._write(self._now, {}, is_last=True)
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _write(self, now: float, state: Mapping[str, Reading], *, is_last: bool = False) -> None:
        written = {
            name: [_to_json(one.value), one.time if isfinite(one.time) else None]
            for name, one in state.items()
            if name in self._kept
        }
        self._now = now
        used = None if self._usage is None else self._usage(is_last)
        extra = {} if used is None else {"modules": used}
        line = json.dumps({"time": now, "state": written, **extra}, separators=(",", ":")) + "\n"
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
