"""What was measured while a run went on, ten times a second, as a file that grows line by line.

For whoever looks on or looks back: `aeros top` and `aeros report`.  It is no record: nothing is decided by
it, it is not chained, and what cannot be written is counted and left out, as no robot stops for a plot.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from math import inf, isfinite
from os import SEEK_END
from pathlib import Path
from typing import Any, Final, Self

from aeros.runtime.bus.message_publisher import RobotChain
from aeros.runtime.ports import Reading, Readings
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import FamilyType, VectorType
from aeros.spec.model.model import Site

FILE: Final = "measured.jsonl"
"""Its name in the folder of a run."""

PERIOD: Final = 0.1
"""Plant seconds between lines about control ticks, and between observations of the same truths."""

_DIGITS: Final = 6


class SampleWriter:
    """Writes what it hears of to `path`, as `{"time": T, "state": {NAME: [VALUE, MEASURED_AT]}}`; SI.

    Kept is each single value of the vocabulary, and whatever else the site's rules read.
    lost: lines that could not be written.
    """

    def __init__(self, path: Path, site: Site) -> None:
        self.lost = 0
        self._kept = _recorded_variables(site)
        self._last: dict[str, float] = {}
        self._truths: dict[str, Any] = {}
        # A run that goes on after a crash goes on with its file, on a line of its own.
        self._file = path.open("a+b", buffering=0)
        if self._file.tell() > 0:
            self._file.seek(-1, SEEK_END)
            if self._file.read(1) != b"\n":
                self._file.write(b"\n")

    def on_tick(self, now: float, values: Mapping[str, Any], chain: RobotChain) -> None:
        """What was measured at a control tick."""
        if now - self._last.get("tick", -inf) >= PERIOD:
            self._last["tick"] = now
            self._write(now, {name: _read(value, now) for name, value in values.items()})

    def on_observed(self, readings: Readings, chain: RobotChain) -> None:
        """What was measured, each value at its own time."""
        state = {name: _read(reading, inf) for name, reading in readings.items()}
        now = max((reading.time for reading in state.values() if isfinite(reading.time)), default=inf)
        truths = {name: one.value for name, one in state.items() if type(one.value) in (bool, str)}
        is_due = now - self._last.get("observed", -inf) >= PERIOD or truths != self._truths
        if isfinite(now) and is_due:
            self._last["observed"], self._truths = now, truths
            self._write(now, state)

    def close(self) -> None:
        """Nothing more will be written."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _write(self, now: float, state: Mapping[str, Reading]) -> None:
        told = {
            name: [_to_json(one.value), one.time if isfinite(one.time) else None]
            for name, one in state.items()
            if name in self._kept
        }
        line = json.dumps({"time": now, "state": told}, separators=(",", ":")) + "\n"
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
    """`value` as a reading with a time that is a number, `now` where it has none of its own."""
    if type(value) is not Reading:
        return Reading(value, now)
    return value if type(value.time) in (float, int) else Reading(value.value, inf)


def _to_json(value: Any) -> Any:
    """A value as JSON, to six digits; None of what has no form of the vocabulary's."""
    if type(value) in (tuple, list):
        return [_to_json(part) for part in value]
    if type(value) in (bool, str):
        return value
    if type(value) in (float, int) and isfinite(value):
        return float(f"{value:.{_DIGITS}g}")
    return None
