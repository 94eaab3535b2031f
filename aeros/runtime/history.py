"""Keeps the histories that Φ reads: past-time conditions over what is measured, each in bounded memory.

A moment is a look at the state: every decision and every control tick.  A reading speaks for the
time from its own to its `max_age` later.  Where nothing speaks for a moment, or for the time between
two, a condition is neither true nor false there, and a history is unknown for as long as that could
make a difference; the gate denies what depends on it.  What was before the first moment is not looked at.

The definition is `semantics.evaluate` along the trace of moments; where a history is known it is
what that says (tests/differential/test_past_time.py).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Protocol

from aeros.runtime.conditions import CompiledCondition
from aeros.runtime.form import Form, Scalars, check_now, forms_of
from aeros.runtime.intake import take_reading
from aeros.runtime.ports import Reading, Readings
from aeros.spec.doubles import neighbours
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
        self._latest: float | None = None

    def advance(self, readings: Readings, now: float) -> dict[str, Reading]:
        """Look at the state as it is `now`; each history that is known then, by its name.

        After a time that is none, or earlier than one before, nothing is known until it has passed.
        """
        if not self._kept:
            return {}
        at = None if check_now(now) is not None else float(now)
        if at is None or (self._latest is not None and at < self._latest):
            for one in self._kept:
                one.spoken = None
            return {}
        self._latest, values = at, Scalars()
        times = {
            name: self._take(form, readings.get(name), now, values) for name, form in self._forms.items()
        }
        known: dict[str, Reading] = {}
        for one in self._kept:
            value = one.step(at, values, times)
            if value is not None:
                values[one.name] = float(value) if type(value) is int else value
                known[one.name] = Reading(value, now)
        return known

    def _take(self, form: Form, reading: Reading | None, now: float, values: Scalars) -> float | None:
        """The time of the reading of a variable; None, and no value of it, where it does not speak now."""
        if reading is None or take_reading(form, reading, now, True, values) is not None:
            for scalar in form.names:
                values.pop(scalar, None)
            return None
        return float(reading.time)


class _Window:
    """Whether two times are at most `length` apart: exactly, and quick where rounding cannot matter.

    A difference of doubles is rounded in order, so outside the doubles next to `length` it tells.
    """

    def __init__(self, length: Fraction) -> None:
        self._length = length
        self._below, self._above = neighbours(length)

    def spans(self, earlier: float, later: float) -> bool:
        apart = later - earlier
        if apart < self._below:
            return True
        return apart <= self._above and Fraction(later) - Fraction(earlier) <= self._length


class _Operator(Protocol):
    """One past-time operator's memory."""

    def step(self, at: float, *operands: _Known) -> bool | int | None:
        """Its value at `at`, after the moments it was told of before; None where nobody knows."""


@dataclass
class _Kept:
    """A history under way.

    reads: the state variables it depends on, also through other histories; without any it has no gaps.
    spoken: the times of the readings of the last moment, and for how long each speaks; None before
        the first, and where one does not speak at all.
    """

    name: str
    reads: Mapping[str, _Window]
    operands: tuple[CompiledCondition, ...]
    operator: _Operator
    began: bool = False
    spoken: Sequence[tuple[float, _Window]] | None = None

    def step(self, at: float, values: Scalars, times: Mapping[str, float | None]) -> bool | int | None:
        if self.began and self.reads and self._is_after_a_gap(at):
            self.operator.step(at, *(_truth(one, {}) for one in self.operands))  # a gap that ends now
        self.began = True
        self.spoken = []
        for name, window in self.reads.items():
            time = times[name]
            if time is None:
                self.spoken = None
                break
            self.spoken.append((time, window))
        return self.operator.step(at, *[_truth(one, values) for one in self.operands])

    def _is_after_a_gap(self, at: float) -> bool:
        if self.spoken is None:
            return True
        return any(not window.spans(time, at) for time, window in self.spoken)


class _Previously:
    def __init__(self) -> None:
        self._last: _Known = False

    def step(self, at: float, *operands: _Known) -> bool | None:
        value, (self._last,) = self._last, operands
        return value


class _Since:
    """The last time of `reset` that `kept` has followed: surely, and as far as anybody knows."""

    def __init__(self, within: Fraction | None) -> None:
        self._within = None if within is None else _Window(within)
        self._surely: float | None = None
        self._maybe: float | None = None

    def step(self, at: float, *operands: _Known) -> bool | None:
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
        if self._maybe == self._surely:  # as always where everything is known
            return surely
        return surely if surely is self._is_recent(self._maybe, at) else None

    def _is_recent(self, time: float | None, at: float) -> bool:
        return time is not None and (self._within is None or self._within.spans(time, at))


class _Occurrences:
    """Times at which the operand held, and the last at which nobody knows whether it did.

    most: times that are kept; of more in one window nobody knows how many.
    """

    def __init__(self, within: Fraction, most: int) -> None:
        self._within = _Window(within)
        self._most = most
        self._times: deque[float] = deque()
        self._uncounted: float | None = None

    def step(self, at: float, *operands: _Known) -> int | None:
        (held,) = operands
        if held is True:
            self._times.append(at)
        elif held is None:
            self._uncounted = at
        while self._times and not self._within.spans(self._times[0], at):
            self._times.popleft()
        if len(self._times) > self._most:
            self._uncounted = self._times.popleft()
        if self._uncounted is not None and self._within.spans(self._uncounted, at):
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
    spoken = {name: _Window(observed[name].max_age or Fraction(0)) for name in sorted(reads)}
    return _Kept(history.declared.name, spoken, conditions, operator)


def _most(declared: Declared) -> int:
    return int(declared.range[1]) if declared.range is not None else 0


def _reads(history: History, reads: Mapping[str, frozenset[str]]) -> frozenset[str]:
    """The state variables that a history depends on."""
    return frozenset().union(*(reads[name] for name in t.variables_of(history.term)))


def _truth(condition: CompiledCondition, values: Mapping[str, Any]) -> _Known:
    if not condition.names <= values.keys():
        return None
    return condition.holds(values)
