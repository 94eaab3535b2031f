"""Histories that Φ reads: past-time conditions on measured values, each tracked in bounded memory.

The tracker is updated at every decision and every control tick; each update is a sample of the state. A
reading is valid from its own time until its `max_age` later. If no reading is valid at a sample, or between
two samples, the condition is unknown there, and a history is unknown for as long as that could make a
difference; the gate denies what depends on it. Nothing before the first sample counts.

The definition is `semantics.evaluate` along the trace of samples; a known history equals its result
(tests/differential/gate/test_past_time.py).

All histories of a site are one generated function on local variables, because every control tick waits for
it.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from fractions import Fraction
from itertools import chain

from aeros.runtime.gate.compiled.codegen import EXACT_INTEGERS, FunctionWriter, double_of
from aeros.runtime.gate.quotas import TimeWindow
from aeros.runtime.gate.value_check import ValueChecker, value_checkers
from aeros.runtime.ports import Reading, Readings, Snapshot
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower
from aeros.spec.expr.semantics import is_true
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared, History

HistoryValues = dict[str, bool | int]
"""Value of each known history, by its name."""


class HistoryTracker:
    """The histories of one site, beginning with the first sample.

    Attributes:
        names: the names of the histories.
    """

    advance: Callable[[Readings, float], HistoryValues]
    """Update the histories with the readings at a time (plant seconds), and return those that are known then.

    If the time is malformed or earlier than a previous one, nothing is known until it has passed.
    """

    def __init__(self, site: Site) -> None:
        self.names = frozenset(one.declared.name for one in site.histories)
        self.advance = _HistoryWriter(site).build_function()

    def update(self, measured: Readings, now: float) -> Readings:
        """Update the histories, and add their values to the readings.

        Args:
            measured: the current readings; a history in them is ignored.
            now: plant time, s.

        Returns:
            The readings with each known history; `measured` itself is not modified.
        """
        if not self.names:
            return measured if type(measured) is Snapshot else dict(measured)
        readings = dict(measured)
        for name in self.names & measured.keys():
            del readings[name]
        known = self.advance(readings, now)
        return readings | {name: Reading(value, now) for name, value in known.items()}


class _HistoryWriter(FunctionWriter):
    """Writer of `advance`, on its own variables and on those of an enclosing function, which outlast a call.

    For each state variable, by number: `t` is the time of its reading, None if that is not valid now; `p` the
    same at the previous sample; `g` is True if there was a gap in between.
    For each history, by number: `h` is its value, and `o` those of its operands, None if unknown.
    """

    exit_statement = "break"

    def __init__(self, site: Site) -> None:
        super().__init__()
        self.names["deque"] = deque
        self._outlasting = {"latest": repr(-EXACT_INTEGERS)}
        self._observed = site.observed_variables
        self._histories = site.histories
        self._reads = {name: frozenset((name,)) for name in site.state}
        for history in site.histories:
            read = [self._reads[name] for name in t.variables_of(history.term)]
            self._reads[history.declared.name] = frozenset().union(*read)
        used = frozenset().union(*(self._reads[history.declared.name] for history in site.histories))
        self._forms = value_checkers(
            {name: variable for name, variable in site.state.items() if name in used}
        )
        self._number = {name: number for number, name in enumerate(self._forms)}
        self._known = {name: f"t{number} is not None" for name, number in self._number.items()}
        for number, history in enumerate(site.histories):
            self._known[history.declared.name] = f"h{number} is not None"

    def build_function(self) -> Callable[[Readings, float], HistoryValues]:
        """Write and compile the function, in its state before the first sample."""
        self._write_time_check()
        for name, form in self._forms.items():
            self._state(self._number[name], form)
        operands = [_operands(one) for one in self._histories]
        for number, one in enumerate(self._histories):
            self.local[one.declared.name] = f"h{number}"
        written = iter(self.condition_codes(list(chain(*operands)), self._observed.values()))
        for number, one in enumerate(self._histories):
            self._history(number, one, [(term, next(written)) for term in operands[number]])
        for number in self._number.values():
            self.add_line(f"p{number} = t{number}")
        self.add_line("known = {}")
        for number, one in enumerate(self._histories):
            self.add_line(f"if h{number} is not None: known[{one.declared.name!r}] = h{number}")
        self.add_line("return known")
        outlasting = [f"  {name} = {initially}" for name, initially in self._outlasting.items()]
        head = ["  def advance(readings, now):", f"    nonlocal {', '.join(self._outlasting)}"]
        body = [f"  {line}" for line in self.lines]
        source = ["def keeping():", *outlasting, *head, *body, "  return advance"]
        advance: Callable[[Readings, float], HistoryValues] = self.compile_function("keeping", source)()
        return advance

    def _write_time_check(self) -> None:
        """Add a check of `now`; at a malformed or earlier time, no reading is valid until the next sample."""
        self.add_line(f"exactly = {double_of('now')}")
        self.add_line(f"if not (latest <= exactly <= {EXACT_INTEGERS}):")
        for number in self._number.values():
            self.add_line(f"  if p{number} != inf: p{number} = None")
        self.add_line("  return {}")
        self.add_line("latest = time = exactly")
        self.add_line("measured, age = now, 0.0")

    def _state(self, number: int, checker: ValueChecker) -> None:
        """Add code that reads a state variable, if its reading is present, well-formed and fresh."""
        limit = checker.declared.max_age
        self.add_line(f"t{number} = None")
        self.add_line("while True:")
        start = len(self.lines)
        self.add_line(f"reading = readings.get({checker.declared.name!r})")
        self.write_reading(checker)
        if limit is not None:
            self.write_guard(self._is_recent("time", limit))
        self.add_line(f"t{number} = time")
        self.add_line("break")
        self.indent(start)
        self._outlasting[f"p{number}"] = "inf"  # nothing is missing before the first sample
        spoke_until_now = self._is_recent(f"p{number}", limit or Fraction(0))
        self.add_line(f"g{number} = p{number} is None or not {spoke_until_now}")

    def _history(self, number: int, history: History, operands: Sequence[tuple[t.Term, str]]) -> None:
        """Add one history: an update for a gap that ends now, if any, then one for this sample."""
        constants = [_constant(term) for term, _ in operands]
        gaps = [f"g{self._number[name]}" for name in sorted(self._reads[history.declared.name])]
        if gaps:
            self.add_line(f"if {' or '.join(gaps)}:")
            start = len(self.lines)
            self._update_history(number, history, [repr(one) for one in constants])
            self.indent(start)
        codes = []
        for place, (term, code) in enumerate(operands):
            codes.append(f"o{number}_{place}")
            known = " and ".join(self._known[name] for name in t.variables_of(term))
            self.add_line(f"{codes[-1]} = ({code}) if {known or True} else None")
        match history.term:
            case t.Previously():
                self.add_line(f"h{number} = last{number}")
                self._outlasting[f"last{number}"] = "False"
                self._update_history(number, history, codes)
            case t.Since(window_s=within):
                self._update_history(number, history, codes)
                self._since(number, within)
            case t.Occurrences(window_s=within):
                self._update_history(number, history, codes)
                self._occurrences(number, within, _max_count(history.declared))

    def _update_history(self, number: int, history: History, operands: Sequence[str]) -> None:
        """Add the update of a history's stored state by a sample with these operands."""
        match history.term:
            case t.Previously():
                self.add_line(f"last{number} = {operands[0]}")
            case t.Since():
                kept, reset = operands
                self.add_line(f"if {kept} is not True: surely{number} = -inf")
                self.add_line(f"if {kept} is False: maybe{number} = -inf")
                self.add_line(f"if {reset} is True: surely{number} = exactly")
                self.add_line(f"if {reset} is not False: maybe{number} = exactly")
            case t.Occurrences():
                self.add_line(f"if {operands[0]} is True: times{number}.append(exactly)")
                self.add_line(f"if {operands[0]} is None: uncounted{number} = exactly")

    def _since(self, number: int, window_s: Fraction | None) -> None:
        """Add the value of a `since`: the last time of `reset` since when `kept` held, surely and maybe."""
        surely, maybe = f"surely{number}", f"maybe{number}"
        self._outlasting |= {surely: "-inf", maybe: "-inf"}
        self.add_line(f"h{number} = {self._is_recent(surely, window_s)}")
        # The two are equal if everything is known.
        self.add_line(f"if {maybe} != {surely} and h{number} is not ({self._is_recent(maybe, window_s)}):")
        self.add_line(f"  h{number} = None")

    def _occurrences(self, number: int, window_s: Fraction, max_count: int) -> None:
        """Add the value of a count.

        It stores the times at which the operand held, and the last time at which it was unknown.
        max_count: number of times that are stored; a larger count in one window is unknown.
        """
        times, uncounted = f"times{number}", f"uncounted{number}"
        self._outlasting |= {times: "deque()", uncounted: "-inf"}
        self.add_line(
            f"while {times} and not ({self._is_recent(f'{times}[0]', window_s)}): {times}.popleft()"
        )
        self.add_line(f"if len({times}) > {max_count}: {uncounted} = max({uncounted}, {times}.popleft())")
        self.add_line(f"h{number} = None if {self._is_recent(uncounted, window_s)} else len({times})")

    def _is_recent(self, time: str, window_s: Fraction | None) -> str:
        """Return an expression: is a time at most `window_s` before this sample? `-inf` never is."""
        if window_s is None:
            return f"{time} != -inf"
        # `TimeWindow.contains`, inlined.
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
    """Return the truth of a condition that reads no variable; None for others."""
    return None if t.variables_of(term) else is_true(lower(term), {})


def _max_count(declared: Declared) -> int:
    assert declared.range is not None  # noqa: S101  every count has one
    return int(declared.range[1])
