"""Stop recorder: measures how a stop went, from the tick at which it began until the robot is at rest."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import dist, inf
from typing import Any, Final, NamedTuple

from aeros.runtime.ports import Reading
from aeros.spec.expr.types import FamilyType, RealType, VectorType
from aeros.spec.expr.units import ANGLE, JOINT, LENGTH
from aeros.spec.model.site import Site

_OMITTED_DIMENSIONS: Final = (ANGLE, JOINT)
"""Dimensions of quantities whose extremes say nothing about a stop: positions of joints."""

_AXES: Final = 3
"""Coordinates of a position."""


class StopQuantities(NamedTuple):
    """State variables that a stop's record is about.

    Attributes:
        scales: unit of each real variable, and of each family of them, by name.
        places: positions; the record has the distance that each covered.
    """

    scales: Mapping[str, str]
    places: tuple[str, ...]


def stop_quantities(site: Site) -> StopQuantities:
    """List the state variables of a site that a stop's record is about.

    Args:
        site: the site.

    Returns:
        Every real variable but angles, and every position.
    """
    scales, places = {}, []
    for name, declared in site.state.items():
        type_ = declared.variable.type
        if type_ == VectorType(LENGTH):
            places.append(name)
        element = type_.element if isinstance(type_, FamilyType) else type_
        if isinstance(element, RealType) and element.dimension not in _OMITTED_DIMENSIONS:
            scales[name] = str(element.dimension)
    return StopQuantities(scales, tuple(places))


class StopRecorder:
    """Recorder of one stop.

    Args:
        quantities: variables to record.
        reason: why the robot stops: a rule's id, or words.
        now: plant time at which the stop begins, s.

    Attributes:
        reason: as given.
    """

    def __init__(self, quantities: StopQuantities, reason: str, now: float) -> None:
        self.reason = reason
        self._quantities = quantities
        self._began = now
        self._ticks = 0
        self._least: dict[str, float] = {}
        self._greatest: dict[str, float] = {}
        self._ways: dict[str, float] = {}
        self._last: dict[str, tuple[float, ...]] = {}

    def add(self, measured: Mapping[str, Any]) -> None:
        """Add what was measured at a tick of the stop; malformed values are left out.

        Args:
            measured: values (SI) or readings, by vocabulary name.
        """
        self._ticks += 1
        for name in self._quantities.scales:
            value = _value(measured, name)
            values = value if type(value) in (tuple, list) else (value,)
            if _are_finite(values):
                sizes = values if values == (value,) else [abs(one) for one in values]
                self._least[name] = min(self._least.get(name, inf), *sizes)
                self._greatest[name] = max(self._greatest.get(name, -inf), *sizes)
        for name in self._quantities.places:
            place = _value(measured, name)
            if type(place) not in (tuple, list) or len(place) != _AXES or not _are_finite(place):
                continue
            if name in self._last:
                self._ways[name] = self._ways.get(name, 0.0) + dist(place, self._last[name])
            self._last[name] = tuple(place)

    def details(self, now: float) -> dict[str, Any]:
        """Describe the stop for the audit record.

        Args:
            now: plant time at which the robot is at rest, s.

        Returns:
            JSON values: `reason`; `began` and `time` (its end), s; `ticks` that were measured; for each
            quantity its least and greatest value (of a family, of the absolute values) and its unit; and the
            length of the way of each position, m.
        """
        return {
            "time": now,
            "began": self._began,
            "ticks": self._ticks,
            "reason": self.reason,
            "quantities": {
                name: {"least": self._least[name], "greatest": self._greatest[name], "unit": unit}
                for name, unit in self._quantities.scales.items()
                if name in self._least
            },
            "ways": dict(self._ways),
        }


class StopRecords:
    """Recorders of the stops under way: of the whole robot, and of single actions that are halted.

    Args:
        quantities: variables to record.

    Attributes:
        are_open: True if anything is being recorded.
        stop: of the whole robot; None unless it is being stopped.
        late_ticks: ticks of the session so far that came late; only on plants that run in real time.
    """

    def __init__(self, quantities: StopQuantities) -> None:
        self.are_open = False
        self.stop: StopRecorder | None = None
        self.late_ticks = 0
        self._quantities = quantities
        self._halts: dict[int, StopRecorder] = {}  # by number of the decision's record

    def begin_stop(self, reason: str, now: float) -> None:
        """Record a stop of the whole robot from now on, unless one is recorded already.

        Args:
            reason: id of the rule that stops it, or words.
            now: plant time, s.
        """
        if self.stop is None:
            self.stop, self.are_open = StopRecorder(self._quantities, reason, now), True

    def begin_halt(self, record_number: int, reason: str, now: float) -> None:
        """Record how one action comes to rest from now on, while others go on.

        Args:
            record_number: number of the record of its decision.
            reason: words.
            now: plant time, s.
        """
        self._halts.setdefault(record_number, StopRecorder(self._quantities, reason, now))
        self.are_open = True

    def add(self, measured: Mapping[str, Any]) -> None:
        """Add what was measured at a tick to every record.

        Args:
            measured: values (SI) or readings, by vocabulary name.
        """
        for recorder in self._halts.values():
            recorder.add(measured)
        if self.stop is not None:
            self.stop.add(measured)

    def clear(self) -> None:
        """Drop all records: no action is under way."""
        self.stop, self.are_open = None, False
        self._halts.clear()

    def end_stop(self, now: float) -> dict[str, Any] | None:
        """End the record of the whole robot's stop: it is at rest.

        Args:
            now: plant time, s.

        Returns:
            Details for the audit record; None if there was no stop.
        """
        recorder, self.stop = self.stop, None
        self.are_open = bool(self._halts)
        return None if recorder is None else self._details(recorder, now)

    def end_halt(self, record_number: int, now: float) -> dict[str, Any] | None:
        """End the record of an action's halt: it is at rest.

        Args:
            record_number: number of the record of its decision.
            now: plant time, s.

        Returns:
            Details for the audit record; None if it was not halted.
        """
        recorder = self._halts.pop(record_number, None)
        self.are_open = bool(self._halts) or self.stop is not None
        return None if recorder is None else self._details(recorder, now)

    def _details(self, recorder: StopRecorder, now: float) -> dict[str, Any]:
        late = {"late_ticks": self.late_ticks} if self.late_ticks else {}
        return {**recorder.details(now), **late}


def _value(measured: Mapping[str, Any], name: str) -> Any:
    value = measured.get(name)
    return value.value if type(value) is Reading else value


def _are_finite(values: Iterable[object]) -> bool:
    return all(type(one) is float and abs(one) < inf for one in values)
