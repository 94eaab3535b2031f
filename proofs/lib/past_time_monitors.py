"""Monitors of past-time conditions, explored: the step that `history.py` writes, and its reference.

The step is written for one history by the code that ships, and run from any state that it may be in.
Put aside are how one reading is taken, whose own theorem is `gate_totality`, and whether a time is
within a window, which is explored by itself.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import copy
from fractions import Fraction
from math import inf
from types import SimpleNamespace
from typing import Any, Final, cast

from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.expr import terms as t
from aeros.spec.expr.parser import parse
from aeros.spec.expr.scope import Scope
from aeros.spec.expr.typecheck.check import check
from aeros.spec.expr.types import BOOL
from aeros.spec.model.variables import Declared, History
from aeros.spec.theorems.module_copies import ModuleSource, install_stubs
from aeros.spec.theorems.smtlib import smt_apply, smt_literal
from aeros.spec.theorems.symbolic_execution import (
    DecideBranch,
    DecisionDiagram,
    SymbolicValue,
    execute_symbolically,
    term_of,
)
from proofs.lib import time_windows

HISTORY: Final = "aeros.runtime.monitor.history"
PAST_TIME: Final = "aeros.spec.elaborate.past_time"
TYPECHECK: Final = "aeros.spec.expr.typecheck.check"
TRAVERSAL: Final = "aeros.spec.expr.typecheck.traversal"
PAST_OPERATORS: Final = "aeros.spec.expr.typecheck.past_operators"
SEMANTICS: Final = "aeros.spec.expr.semantics"

WINDOW: Final = Fraction(1)
"""The window of conditions; times are any reals, so that their unit is a window of any length."""

_AGE: Final = Fraction(2)
_LENGTHS: Final = {WINDOW: "window", _AGE: "max-age"}

_ANY_TIME: Final = cast("Any", None)
"""Stand-in for a source location, which no monitor reads."""

_STATE: Final = {
    name: Declared(t.Variable(name, BOOL, t.VariableRole.STATE), _ANY_TIME, max_age=_AGE, sensor="eye")
    for name in "ab"
}

TRUTH_SORT: Final = (
    "(declare-datatypes ((Told 0)) (((unknown) (yes) (no))))",
    "(define-fun told-of ((is Bool)) Told (ite is yes no))",
)
"""Sort of a condition's answer."""

TIMES: Final = (
    *TRUTH_SORT,
    "(declare-datatypes ((Time 0)) (((never) (at (when Real)) (lapsed) (first))))",
    "(declare-const now Real)",
    "(declare-const later Real)",
    "(declare-const max-age Real)",
    "(define-fun window () Real 1.0)",
    *(
        f"(declare-const {name}.{what} {sort})"
        for name in _STATE
        for what, sort in (("serves", "Bool"), ("time", "Real"), ("value", "Bool"), ("held", "Bool"))
    ),
    "(define-fun is-recent ((time Time) (present Real)) Bool"
    " (and ((_ is at) time) (<= (- present (when time)) window)))",
)
"""Of each state variable: whether a reading of it serves, of when and what it is, and what is so.

`never` and `first` are before the first moment, of what was and of what spoke; `lapsed` is no reading.
"""


class _SymbolicTime(SymbolicValue):
    """A time that is known; infinities are before and after all others."""

    __slots__ = ()

    def __ne__(self, other: object) -> Any:
        return True if isinstance(other, float) else SymbolicValue.__ne__(self, other)

    def __sub__(self, other: Any) -> Any:
        return _TimeDifference(SymbolicValue.__sub__(self, other).term, self.ask)


class _TimeDifference(SymbolicValue):
    """Symbolic difference of two times; one question decides each comparison with it."""

    __slots__ = ()

    def __le__(self, other: Any) -> Any:
        return self.ask(SymbolicValue.__le__(self, other).term)

    def __gt__(self, other: Any) -> Any:
        return not self <= other


def past_term(text: str) -> t.Term:
    """The condition on `a` and `b` that `text` states, by the parser and the type checker that ship."""
    scope = Scope({name: one.variable for name, one in _STATE.items()}, past=True)
    return check(parse(text), scope, BOOL)


class _GeneratedMonitor:
    """The step for the histories of one condition, before the first moment.

    most: occurrences that are kept, in place of `MAX_OCCURRENCE_COUNT`.
    """

    def __init__(self, code: ModuleSource, term: t.Term, max_count: int) -> None:
        collected = code.module(PAST_TIME, MAX_OCCURRENCE_COUNT=max_count).HistoryCollector()
        self.flat: t.Term = collected.replace_past_terms(term, _ANY_TIME)
        self.histories = collected.collected
        self._writer = _writer_of(code.module(HISTORY))(_site(self.histories))
        self.advance = self._writer.build_function()
        self._first = {name: self[name] for name in self.advance.__code__.co_freevars}

    def reset(self) -> None:
        """Be before the first moment again."""
        for name, value in self._first.items():
            self[name] = copy(value)

    def with_stubs(self, **names: Any) -> None:
        """Let the written code have these in place of what is put aside."""
        self._writer.names.update(names, type=lambda _: float, max=_max_time_stub)

    def __getitem__(self, variable: str) -> Any:
        return self._cell(variable).cell_contents

    def __setitem__(self, variable: str, value: Any) -> None:
        self._cell(variable).cell_contents = value

    def _cell(self, variable: str) -> Any:
        names = self.advance.__code__.co_freevars
        return self.advance.__closure__[names.index(variable)]


def _site(histories: Sequence[History]) -> Any:
    declared = {one.declared.name: one.declared for one in histories}
    return SimpleNamespace(state=_STATE, histories=histories, observed_variables={**_STATE, **declared})


def _writer_of(history: Any) -> Any:
    class Writer(history._HistoryWriter):  # type: ignore[misc]
        """The writer of the step, with readings and windows put aside."""

        def write_reading(self, form: Any) -> None:
            (name,) = form.names
            self.local[name] = f"x{len(self.local)}"
            self.write_guard(f"serves({name!r})")
            self.add_line(f"time = time_of({name!r})")
            self.add_line(f"{self.local[name]} = value_of({name!r})")

        def _is_recent(self, time: str, within: Fraction | None) -> str:
            number = "None" if within is None else repr(float(within))
            return f"recent({time}, exactly, {number})"

    return Writer


def _max_time_stub(one: Any, other: Any) -> Any:
    """Stands for `max`, of times."""
    if -inf in (one, other) if isinstance(one, float) or isinstance(other, float) else False:
        return other if isinstance(one, float) else one
    return one if bool(other <= one) else other


def _recent_stub(time: Any, present: Any, length: float | None) -> bool:
    """Stands for the code of `_is_recent`, as the obligations `recent-…` say what that comes to."""
    if isinstance(time, float):
        return time == inf
    if length is None:
        return True
    return bool((present - time) <= SymbolicValue(_LENGTHS[Fraction(length)], present.ask))


# One step, from any state.

Written = Callable[[_GeneratedMonitor], Iterator[str]]
"""Function that writes the stored state as terms."""


def _time_of(value: Any) -> str:
    if isinstance(value, float):
        return "first" if value == inf else "never"
    return "lapsed" if value is None else smt_apply("at", value.term)


def _truth_term(value: Any) -> str:
    return {None: "unknown", True: "yes", False: "no"}[value]


def _symbolic_time(ask: DecideBranch, time: str) -> Any:
    return _SymbolicTime(f"(when {time})", ask) if ask(f"((_ is at) {time})") else -inf


def _symbolic_truth(ask: DecideBranch, term: str) -> Any:
    if ask(f"(= {term} unknown)"):
        return None
    return ask(f"(= {term} yes)")


def _since_before(ask: DecideBranch, monitor: _GeneratedMonitor) -> None:
    monitor["surely0"] = _symbolic_time(ask, "(surely before)")
    monitor["maybe0"] = _symbolic_time(ask, "(maybe before)")


def _since_after(monitor: _GeneratedMonitor) -> Iterator[str]:
    yield _time_of(monitor["surely0"])
    yield _time_of(monitor["maybe0"])


def _count_before(ask: DecideBranch, monitor: _GeneratedMonitor) -> None:
    number = 2 if ask("(= (number before) 2)") else 1 if ask("(= (number before) 1)") else 0
    kept = [_SymbolicTime(f"({one} before)", ask) for one in ("oldest", "newest")]
    monitor["times0"] = deque(kept[:number])
    monitor["uncounted0"] = _symbolic_time(ask, "(uncounted before)")


def _count_after(monitor: _GeneratedMonitor) -> Iterator[str]:
    times = [one.term for one in monitor["times0"]]
    yield str(len(times))
    yield from [*times, "0.0", "0.0"][:2]
    yield _time_of(monitor["uncounted0"])


def _previously_before(ask: DecideBranch, monitor: _GeneratedMonitor) -> None:
    monitor["last0"] = _symbolic_truth(ask, "(last before)")


def _previously_after(monitor: _GeneratedMonitor) -> Iterator[str]:
    yield _truth_term(monitor["last0"])


_STATE_ENCODERS: Final[
    Mapping[type, tuple[str, Callable[[DecideBranch, _GeneratedMonitor], None], Written]]
] = {
    t.Since: ("(surely Time) (maybe Time)", _since_before, _since_after),
    t.Occurrences: (
        "(number Int) (oldest Real) (newest Real) (uncounted Time)",
        _count_before,
        _count_after,
    ),
    t.Previously: ("(last Told)", _previously_before, _previously_after),
}


def monitor_state_sort(operator: type) -> tuple[str, ...]:
    """Datatype of the state of a monitor of that operator; `told` is its answer for the moment."""
    sort = "Int" if operator is t.Occurrences else "Told"
    fields = f"(told {sort}) (latest Real) (a.spoke Time) (b.spoke Time) {_STATE_ENCODERS[operator][0]}"
    return (f"(declare-datatypes ((Kept 0)) (((kept {fields}))))", "(declare-const before Kept)")


def execute_step(code: ModuleSource, term: t.PastTerm) -> DecisionDiagram:
    """Execute the step for `term` on any state and any observation: a term of sort Kept."""
    monitor = _GeneratedMonitor(code, term, max_count=2)
    (history,) = monitor.histories
    _, before, __ = _STATE_ENCODERS[type(term)]
    read = _read_by(history.term)

    def run(ask: DecideBranch) -> str:
        spoke: dict[str, Any] = {}
        for number, name in enumerate(read):
            time = f"({name}.spoke before)"
            spoke[f"p{number}"] = inf if ask(f"(= {time} first)") else None
            if spoke[f"p{number}"] is None and not ask(f"(= {time} lapsed)"):
                spoke[f"p{number}"] = _SymbolicTime(f"(when {time})", ask)
        for variable, value in spoke.items():
            monitor[variable] = value
        monitor["latest"] = _SymbolicTime("(latest before)", ask)
        before(ask, monitor)
        monitor.with_stubs(
            serves=lambda name: ask(f"{name}.serves"),
            time_of=lambda name: _SymbolicTime(f"{name}.time", ask),
            value_of=lambda name: ask(f"{name}.value"),
            recent=_recent_stub,
        )
        return _state_term(monitor, monitor.advance({}, _SymbolicTime("now", ask)))

    return execute_symbolically(run)


def execute_initial_state(code: ModuleSource, term: t.PastTerm) -> DecisionDiagram:
    """Execute the initialisation for `term`: a term of sort Kept."""
    monitor = _GeneratedMonitor(code, term, max_count=2)
    return execute_symbolically(lambda _: _state_term(monitor, {}))


def _state_term(monitor: _GeneratedMonitor, known: Mapping[str, Any]) -> str:
    """Term of the monitor's stored state and of its answer."""
    (history,) = monitor.histories
    _, __, after = _STATE_ENCODERS[type(history.term)]
    value = known.get(history.declared.name)
    counting = isinstance(history.term, t.Occurrences)
    answer = smt_literal(-1 if value is None else value) if counting else _truth_term(value)
    read = _read_by(history.term)
    speaks = [_time_of(monitor[f"p{read.index(name)}"]) if name in read else "lapsed" for name in _STATE]
    latest = monitor["latest"]
    when = term_of(latest if isinstance(latest, SymbolicValue) else Fraction(latest))
    return smt_apply("kept", answer, when, *speaks, *after(monitor))


def _read_by(term: t.Term) -> list[str]:
    return [name for name in _STATE if name in t.variables_of(term)]


# Whether a time is in a window, as it is written in place.


def execute_is_recent(code: ModuleSource, length: Fraction) -> DecisionDiagram:
    """Execute the code that `_is_recent` writes: `earlier` lies in the window that ends `later`."""
    history = code.module(HISTORY, using=(time_windows.window_module(code),))

    def run(ask: DecideBranch) -> str:
        writer = history._HistoryWriter(_site(()))
        expression = writer._is_recent("time", length)
        time: Any = -inf if ask("(= which never)") else time_windows.SymbolicDouble("earlier", ask)
        if ask("(= which first)"):
            time = inf
        values = {**writer.names, "time": time, "exactly": time_windows.SymbolicDouble("later", ask)}
        return smt_literal(bool(eval(expression, values)))  # noqa: S307 - the writer's own

    return execute_symbolically(run)


# Whole traces, from the first moment on.


def execute_traces(code: ModuleSource, text: str, length: int) -> DecisionDiagram:
    """Execute the condition at the last of `length` moments: a term of sort Told.

    `unknown` where monitors and reference disagree at any of them, or some history is not known.
    """
    scope = Scope({name: one.variable for name, one in _STATE.items()}, past=True)
    traversal = code.module(TRAVERSAL, using=(code.module(PAST_OPERATORS),))
    term = code.module(TYPECHECK, using=(traversal,)).check(parse(text), scope, BOOL)
    semantics = code.module(SEMANTICS)
    monitor = _GeneratedMonitor(code, term, max_count=length)
    read = _read_by(term)

    def run(ask: DecideBranch) -> str:
        monitor.reset()
        looked_at: list[Any] = []
        found = None
        for number in range(length):
            now = _SymbolicTime(f"time.{number}", ask)
            values = {name: ask(f"{name}.{number}") for name in read}
            looked_at.append(semantics.TimedState(now, values))
            monitor.with_stubs(
                serves=lambda _: True,
                time_of=lambda _, now=now: now,
                value_of=values.__getitem__,
                recent=_recent_without_gaps,
            )
            known = monitor.advance({}, now)
            if len(known) < len(monitor.histories):
                return _truth_term(None)
            env = {**values, **{name: _exact_term(one) for name, one in known.items()}}
            found = semantics.evaluate(monitor.flat, env)
            if found is not semantics.evaluate(term, values, looked_at):
                return _truth_term(None)
        return _truth_term(found)

    return execute_symbolically(run)


def _exact_term(value: bool | int) -> bool | Fraction:
    return value if isinstance(value, bool) else Fraction(value)


def _recent_without_gaps(time: Any, present: Any, length: float | None) -> bool:
    """As `_recent_stub`, where looks are so close that every reading speaks until the next."""
    if length == _AGE:
        return True
    if isinstance(time, float) or length is None:
        return _recent_stub(time, present, length)
    return bool((present - time) <= Fraction(length))


# The reference, one moment at a time.


class _EarlierStateError(Exception):
    """Signal that the reference needs the answer of an earlier moment, outside this step."""


class _TraceLength:
    """Symbolic length of a trace, any number, or index of any of its moments."""

    def __init__(self, ask: DecideBranch) -> None:
        self._ask = ask

    def __gt__(self, other: int) -> bool:
        if other != 1:
            raise InternalError(f"nothing here says whether a trace has more than {other} moments")
        return self._ask("has-before")

    def __add__(self, other: int) -> tuple[str, int]:
        return ("beyond", other)

    def __sub__(self, other: int) -> tuple[str, int]:
        return ("before", other)

    def end_range(self, *bounds: Any) -> Iterator[_TraceLength]:
        """Stands for `range`: one end, whichever it is; of what is behind it, nothing is known."""
        if bounds == (1, ("beyond", 1)):
            yield self  # each of them by itself
        elif bounds == (self, 0, -1):
            if self._ask("is-one"):
                yield self
                raise _EarlierStateError
        else:
            raise InternalError(f"nothing here stands for the ends {bounds}")


class _SymbolicTrace:
    """A trace, of which one moment is looked at: `held` there, at the time `at`."""

    def __init__(self, ask: DecideBranch, length: _TraceLength) -> None:
        self._length = length
        self._values = {name: ask(f"{name}.held") for name in _STATE}
        self._times = {"present": _SymbolicTime("present", ask), "at": _SymbolicTime("at", ask)}

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            if index.start is None and index.step is None and index.stop in (-1, self._length):
                return self._timed_state()
        elif index == -1:
            return SimpleNamespace(time=self._times["present"])
        elif index == ("before", 1):
            return SimpleNamespace(time=self._times["at"])
        raise InternalError(f"nothing here stands for {index} of a trace")

    def _timed_state(self) -> list[Any]:
        return [SimpleNamespace(values=self._values)]


def execute_reference(code: ModuleSource, term: t.PastTerm) -> DecisionDiagram:
    """Execute `evaluate` at one moment; `earlier` if the answer is left to the moments before."""
    semantics = code.module(SEMANTICS, range=None, len=None)

    def run(ask: DecideBranch) -> str:
        length = _TraceLength(ask)
        install_stubs(semantics, {"range": length.end_range, "len": lambda _: length})
        try:
            found = semantics.evaluate(term, {}, _SymbolicTrace(ask, length))
        except _EarlierStateError:
            return "earlier"
        return smt_literal(found if isinstance(found, bool) else int(found))

    return execute_symbolically(run)
