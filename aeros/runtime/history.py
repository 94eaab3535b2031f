"""Keeps the histories that Φ reads: past-time conditions over what is measured, each in bounded memory.

A moment is a look at the state: every decision and every control tick.  A reading speaks for the
time from its own to its `max_age` later.  Where nothing speaks for a moment, or for the time between
two, a condition is neither true nor false there, and a history is unknown for as long as that could
make a difference; the gate denies what depends on it.  What was before the first moment is not looked at.

The definition is `semantics.evaluate` along the trace of moments; where a history is known it is
what that says (tests/differential/test_history.py).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Protocol

from aeros.runtime.conditions import CompiledCondition, Truth
from aeros.runtime.form import Scalars, check_now, forms_of
from aeros.runtime.intake import take_reading
from aeros.runtime.ports import Reading, Readings
from aeros.spec.expr import terms as t
from aeros.spec.model import Declared, History, Site

_Known = bool | None
"""Whether a condition holds; None where nobody knows."""


class Histories:
    """The histories of one site, from the first moment that they are told of."""

    def __init__(self, site: Site) -> None:
        self.names = frozenset(one.declared.name for one in site.histories)
        self._kept: list[_Kept] = []
        reads: dict[str, frozenset[str]] = {name: frozenset((name,)) for name in site.state}
        for one in site.histories:
            reads[one.declared.name] = _reads(one, reads)
            self._kept.append(_keep(one, reads[one.declared.name], site.observed))
        used = frozenset(name for one in self._kept for name in one.reads)
        self._forms = forms_of({name: one for name, one in site.state.items() if name in used})
        self._latest: Fraction | None = None

    def advance(self, readings: Readings, now: float) -> dict[str, Reading]:
        """Look at the state as it is `now`; each history that is known then, by its name.

        After a time that is none, or earlier than one before, nothing is known until it has passed.
        """
        if not self._kept:
            return {}
        at = None if check_now(now) is not None else Fraction(now)
        if at is None or (self._latest is not None and at < self._latest):
            for one in self._kept:
                one.spoken_until = None
            return {}
        self._latest, values = at, Scalars()
        until = {name: self._take(name, readings, now, values) for name in self._forms}
        known: dict[str, Reading] = {}
        for one in self._kept:
            value = one.step(at, values, until)
            if value is not None:
                values[one.name] = float(value) if type(value) is int else value
                known[one.name] = Reading(value, now)
        return known

    def _take(self, name: str, readings: Readings, now: float, values: Scalars) -> Fraction | None:
        """Until when the reading of a variable speaks; None, and no value of it, where it does not now."""
        form, reading = self._forms[name], readings.get(name)
        if reading is None or take_reading(form, reading, now, True, values) is not None:
            for scalar in form.names:
                values.pop(scalar, None)
            return None
        return Fraction(reading.time) + (form.declared.max_age or 0)


class _Operator(Protocol):
    """One past-time operator's memory."""

    def step(self, at: Fraction, *operands: _Known) -> bool | int | None:
        """Its value at `at`, after the moments it was told of before; None where nobody knows."""


@dataclass
class _Kept:
    """A history under way.

    reads: the state variables it depends on, also through other histories; without any it has no gaps.
    spoken_until: up to when the readings of the last moment speak; None before the first, and
        where they do not speak at all.
    """

    name: str
    reads: frozenset[str]
    operands: tuple[CompiledCondition, ...]
    operator: _Operator
    began: bool = False
    spoken_until: Fraction | None = None

    def step(self, at: Fraction, values: Scalars, until: Mapping[str, Fraction | None]) -> bool | int | None:
        if self.began and self.reads and (self.spoken_until is None or at > self.spoken_until):
            self.operator.step(at, *(_truth(one, {}) for one in self.operands))  # a gap that ends now
        self.began = True
        spoken = [until[name] for name in self.reads]
        known = [one for one in spoken if one is not None]
        self.spoken_until = min(known, default=None) if len(known) == len(spoken) else None
        return self.operator.step(at, *(_truth(one, values) for one in self.operands))


class _Previously:
    def __init__(self) -> None:
        self._last: _Known = False

    def step(self, at: Fraction, *operands: _Known) -> bool | None:
        value, (self._last,) = self._last, operands
        return value


class _Since:
    """The last time of `reset` that `kept` has followed: surely, and as far as anybody knows."""

    def __init__(self, within: Fraction | None) -> None:
        self._within = within
        self._surely: Fraction | None = None
        self._maybe: Fraction | None = None

    def step(self, at: Fraction, *operands: _Known) -> bool | None:
        kept, reset = operands
        if kept is not True:
            self._surely = None
        if kept is False:
            self._maybe = None
        if reset is True:
            self._surely = at
        if reset is not False:
            self._maybe = at
        surely = self._is_recent(self._surely, at)
        return surely if surely is self._is_recent(self._maybe, at) else None

    def _is_recent(self, time: Fraction | None, at: Fraction) -> bool:
        return time is not None and (self._within is None or at - time <= self._within)


class _Occurrences:
    """Times at which the operand held, and the last at which nobody knows whether it did.

    most: times that are kept; of more in one window nobody knows how many.
    """

    def __init__(self, within: Fraction, most: int) -> None:
        self._within = within
        self._most = most
        self._times: deque[Fraction] = deque()
        self._uncounted: Fraction | None = None

    def step(self, at: Fraction, *operands: _Known) -> int | None:
        (held,) = operands
        if held is True:
            self._times.append(at)
        elif held is None:
            self._uncounted = at
        while self._times and at - self._times[0] > self._within:
            self._times.popleft()
        if len(self._times) > self._most:
            self._uncounted = self._times.popleft()
        if self._uncounted is not None and at - self._uncounted <= self._within:
            return None
        return len(self._times)


def _keep(history: History, reads: frozenset[str], observed: Mapping[str, Declared]) -> _Kept:
    operands: Sequence[t.Term]
    operator: _Operator
    match history.term:
        case t.Previously(operand=operand):
            operands, operator = (operand,), _Previously()
        case t.Since(kept=kept, reset=reset, within=within):
            operands, operator = (kept, reset), _Since(within)
        case t.Occurrences(operand=operand, within=window):
            operands, operator = (operand,), _Occurrences(window, _most(history.declared))
    conditions = tuple(CompiledCondition(operand, observed.values()) for operand in operands)
    return _Kept(history.declared.name, reads, conditions, operator)


def _most(declared: Declared) -> int:
    return int(declared.range[1]) if declared.range is not None else 0


def _reads(history: History, reads: Mapping[str, frozenset[str]]) -> frozenset[str]:
    """The state variables that a history depends on."""
    return frozenset().union(*(reads[name] for name in t.variables_of(history.term)))


def _truth(condition: CompiledCondition, values: Mapping[str, Any]) -> _Known:
    if not condition.names <= values.keys():
        return None
    return condition.decide(values) is Truth.HOLDS
