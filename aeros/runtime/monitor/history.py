"""Keeps the histories that Φ reads: past-time conditions over what is measured, each in bounded memory.

A moment is a look at the state: every decision and every control tick.  A reading speaks for the
time from its own to its `max_age` later.  Where nothing speaks for a moment, or for the time between
two, a condition is neither true nor false there, and a history is unknown for as long as that could
make a difference; the gate denies what depends on it.  What was before the first moment is not looked at.

The definition is `semantics.evaluate` along the trace of moments; where a history is known it is
what that says (tests/differential/test_past_time.py).

All histories of a site are one generated function, on local variables: a control tick waits for it.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from fractions import Fraction
from itertools import chain
from math import inf

from aeros.runtime.gate.compiled.codegen import EXACT_INTEGERS, FunctionWriter
from aeros.runtime.gate.time_window import TimeWindow
from aeros.runtime.gate.value_check import ValueChecker, value_checkers
from aeros.runtime.ports import Reading, Readings, Snapshot
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower
from aeros.spec.expr.semantics import is_true
from aeros.spec.model.model import Declared, History, Site

HistoryValues = dict[str, bool | int]
"""The value of each history that is known, by its name."""


class HistoryTracker:
    """The histories of one site, from the first moment that they are told of."""

    advance: Callable[[Readings, float], HistoryValues]
    """Look at the state as it is at a time, plant seconds; each history that is known then.

    After a time that is none, or earlier than one before, nothing is known until it has passed.
    """

    def __init__(self, site: Site) -> None:
        self.names = frozenset(one.declared.name for one in site.histories)
        self.advance = _HistoryWriter(site).build_function() if site.histories else lambda readings, now: {}

    def update(self, measured: Readings, now: float) -> Readings:
        """What is measured, and each history that is known after a look at it; both stay as they are."""
        if not self.names:
            return measured if type(measured) is Snapshot else dict(measured)
        readings = dict(measured)
        for name in self.names & measured.keys():
            del readings[name]
        known = self.advance(readings, now)
        return readings | {name: Reading(value, now) for name, value in known.items()}


class _HistoryWriter(FunctionWriter):
    """Writes `advance`, on its own variables and on those of a function around it, which outlast a call.

    Of each state variable, by number: `t` the time of its reading, None where that does not speak now;
    `p` the same at the moment before; `g` whether there was a gap between.
    Of each history, by number: `h` its value, and `a` and `b` its operands', None where nobody knows.
    """

    exit_statement = "break"

    def __init__(self, site: Site) -> None:
        super().__init__()
        self.names |= {"deque": deque, "inf": inf, "max": max}
        self._outlasting = {"latest": repr(-EXACT_INTEGERS)}
        self._observed = site.observed_variables
        self._histories = site.histories
        self._reads = {name: frozenset((name,)) for name in site.state}
        for one in site.histories:
            read = [self._reads[name] for name in t.variables_of(one.term)]
            self._reads[one.declared.name] = frozenset().union(*read)
        used = frozenset().union(*(self._reads[one.declared.name] for one in site.histories))
        self._forms = value_checkers({name: one for name, one in site.state.items() if name in used})
        self._number = {name: number for number, name in enumerate(self._forms)}
        self._known = {name: f"t{number} is not None" for name, number in self._number.items()}
        for number, one in enumerate(site.histories):
            self._known[one.declared.name] = f"h{number} is not None"

    def build_function(self) -> Callable[[Readings, float], HistoryValues]:
        """The function, before the first moment."""
        self._write_time_check()
        for name, form in self._forms.items():
            self._state(self._number[name], form)
        operands = [_operands(one) for one in self._histories]
        for number, one in enumerate(self._histories):
            self.local[one.declared.name] = (
                f"n{number}" if isinstance(one.term, t.Occurrences) else f"h{number}"
            )
        written = iter(self.condition_codes(list(chain(*operands)), self._observed.values()))
        for number, one in enumerate(self._histories):
            self._history(number, one, [(term, next(written)) for term in operands[number]])
        for number in self._number.values():
            self.add_line(f"p{number} = t{number}")
        self.add_line("known = {}")
        for number, one in enumerate(self._histories):
            self.add_line(f"if h{number} is not None: known[{one.declared.name!r}] = h{number}")
        self.add_line("return known")
        self.indent(0)
        outlasting = [f"  {name} = {initially}" for name, initially in self._outlasting.items()]
        head = ["  def advance(readings, now):", f"    nonlocal {', '.join(self._outlasting)}"]
        source = ["def keeping():", *outlasting, *head, *self.lines, "  return advance"]
        advance: Callable[[Readings, float], HistoryValues] = self.compile_function("keeping", source)()
        return advance

    def _write_time_check(self) -> None:
        """Now; at one that is none, or before the last, nothing speaks until there is a next."""
        self.add_line("exactly = now if type(now) is float else whole(now)")
        self.add_line(f"if not (latest <= exactly <= {EXACT_INTEGERS}):")
        for number in self._number.values():
            self.add_line(f"  if p{number} != inf: p{number} = None")
        self.add_line("  return {}")
        self.add_line("latest = time = exactly")
        self.add_line("measured, age = now, 0.0")

    def _state(self, number: int, checker: ValueChecker) -> None:
        """Takes the reading of a state variable, where it is there, well-formed and fresh."""
        limit = checker.declared.max_age
        self.add_line(f"t{number} = None")
        self.add_line("try:")
        self.add_line("  while True:")
        start = len(self.lines)
        self.add_line(f"reading = readings.get({checker.declared.name!r})")
        self.write_reading(checker)
        if limit is not None:
            self.write_guard(self._is_recent("time", limit))
        self.add_line(f"t{number} = time")
        self.add_line("break")
        self.indent(start)
        self.indent(start)
        self.add_line("except IndexError: pass")
        self._outlasting[f"p{number}"] = "inf"  # before the first moment nothing was missed
        spoke_until_now = self._is_recent(f"p{number}", limit or Fraction(0))
        self.add_line(f"g{number} = p{number} is None or not {spoke_until_now}")

    def _history(self, number: int, history: History, operands: Sequence[tuple[t.Term, str]]) -> None:
        """One history: told of a gap that ends now, if there was one, then of this moment."""
        constants = [_constant(term) for term, _ in operands]
        gaps = [f"g{self._number[name]}" for name in sorted(self._reads[history.declared.name])]
        if gaps:
            self.add_line(f"if {' or '.join(gaps)}:")
            start = len(self.lines)
            self._update_history(number, history, [repr(one) for one in constants])
            self.indent(start)
        told = []
        for local, constant, (term, code) in zip("ab", constants, operands, strict=False):
            told.append(repr(constant) if constant is not None else f"{local}{number}")
            if constant is None:
                known = " and ".join(self._known[name] for name in t.variables_of(term))
                self.add_line(f"{told[-1]} = ({code}) if {known} else None")
        match history.term:
            case t.Previously():
                self.add_line(f"h{number} = last{number}")
                self._outlasting[f"last{number}"] = "False"
                self._update_history(number, history, told)
            case t.Since(window_s=within):
                self._update_history(number, history, told)
                self._since(number, within)
            case t.Occurrences(window_s=within):
                self._update_history(number, history, told)
                self._occurrences(number, within, _max_count(history.declared))

    def _update_history(self, number: int, history: History, operands: Sequence[str]) -> None:
        """What is kept of a moment with these operands."""
        match history.term:
            case t.Previously():
                self.add_line(f"last{number} = {operands[0]}")
            case t.Since():
                kept, reset = operands
                if kept != "True":
                    self.add_line(f"if {kept} is not True: surely{number} = -inf")
                    self.add_line(f"if {kept} is False: maybe{number} = -inf")
                self.add_line(f"if {reset} is True: surely{number} = exactly")
                self.add_line(f"if {reset} is not False: maybe{number} = exactly")
            case t.Occurrences():
                self.add_line(f"if {operands[0]} is True: times{number}.append(exactly)")
                self.add_line(f"if {operands[0]} is None: uncounted{number} = exactly")

    def _since(self, number: int, window_s: Fraction | None) -> None:
        """The last time of `reset` that `kept` has followed: surely, and as far as anybody knows."""
        surely, maybe = f"surely{number}", f"maybe{number}"
        self._outlasting |= {surely: "-inf", maybe: "-inf"}
        self.add_line(f"h{number} = {self._is_recent(surely, window_s)}")
        # Where everything is known, the two are the same.
        self.add_line(f"if {maybe} != {surely} and h{number} is not ({self._is_recent(maybe, window_s)}):")
        self.add_line(f"  h{number} = None")

    def _occurrences(self, number: int, window_s: Fraction, max_count: int) -> None:
        """Times at which the operand held, and the last at which nobody knows whether or how often it did.

        most: times that are kept; of more in one window nobody knows how many.
        """
        times, uncounted = f"times{number}", f"uncounted{number}"
        self._outlasting |= {times: "deque()", uncounted: "-inf"}
        self.add_line(
            f"while {times} and not ({self._is_recent(f'{times}[0]', window_s)}): {times}.popleft()"
        )
        self.add_line(f"if len({times}) > {max_count}: {uncounted} = max({uncounted}, {times}.popleft())")
        self.add_line(f"h{number} = None if {self._is_recent(uncounted, window_s)} else len({times})")
        self.add_line(f"n{number} = None if h{number} is None else float(h{number})")

    def _is_recent(self, time: str, window_s: Fraction | None) -> str:
        """Code for whether a time is at most so long before this moment; `-inf` is at no time."""
        if window_s is None:
            return f"{time} != -inf"
        # As `TimeWindow.spans` decides, in place.
        window, spans = TimeWindow(window_s), f"spans{len(self.names)}"
        self.names[spans] = window.contains_exactly
        quick = f"(apart := exactly - {time}) < {window.surely!r}"
        return f"({quick} or (apart <= {window.maybe!r} and {spans}({time}, exactly)))"


def _operands(history: History) -> tuple[t.Term, ...]:
    match history.term:
        case t.Since(sustained=kept, trigger=reset):
            return kept, reset
        case t.Previously(operand=operand) | t.Occurrences(operand=operand):
            return (operand,)


def _constant(term: t.Term) -> bool | None:
    """Whether a condition holds that reads nothing; None of others."""
    return None if t.variables_of(term) else is_true(lower(term), {})


def _max_count(declared: Declared) -> int:
    return int(declared.range[1]) if declared.range is not None else 0
