"""A history that is known is what the definition says along the trace: the monitors of theorem 10."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import Final

from aeros.spec.expr import terms as t
from aeros.spec.theorems.module_copies import ModuleSource, Mutant
from aeros.spec.theorems.smtlib import smt_and, smt_implies, smt_literal, smt_or
from aeros.spec.theorems.theorem import SymbolicFunction, Theorem, TheoremObligation
from proofs.lib import past_time_monitors, time_windows
from proofs.lib.loops import loops_of

_A, _B = (past_time_monitors.past_term(name) for name in "ab")
_WINDOW: Final = past_time_monitors.WINDOW

# The reference, moment by moment.

_UPDATE_DECLARATIONS: Final = (
    *(f"(declare-const {name} Real)" for name in ("present", "at")),
    *(f"(declare-const {name} Bool)" for name in ("is-one", "has-before", "a.held", "b.held", "earlier")),
)


def _since_recursion(window_s: Fraction | None, code: ModuleSource) -> TheoremObligation:
    soon = "true" if window_s is None else f"(<= (- present at) {smt_literal(window_s)})"
    return TheoremObligation(
        "`evaluate` of `a since b`, at any moment that it looks at: b holds there, or a does and the\n"
        "earlier moments have it so; and it is no longer ago than the window.",
        _UPDATE_DECLARATIONS,
        f"(= found (and is-one {soon} (or b.held (and a.held earlier))))",
        tables=(
            SymbolicFunction(
                "found", "Bool", past_time_monitors.execute_reference(code, t.Since(_A, _B, window_s))
            ),
        ),
    )


def _count_recursion(code: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "`evaluate` of `count within` counts each moment of the window at which its operand holds, once.",
        _UPDATE_DECLARATIONS,
        f"(= found (ite (and a.held (<= (- present at) {smt_literal(_WINDOW)})) 1 0))",
        tables=(
            SymbolicFunction(
                "found", "Int", past_time_monitors.execute_reference(code, t.Occurrences(_A, _WINDOW))
            ),
        ),
    )


def _previously_recursion(code: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "`evaluate` of `previously a` is a at the moment before; false at the first.",
        _UPDATE_DECLARATIONS,
        "(= found (and has-before a.held))",
        tables=(
            SymbolicFunction("found", "Bool", past_time_monitors.execute_reference(code, t.Previously(_A))),
        ),
    )


# A look: what is measured at it, and what was missed before it.


@dataclass(frozen=True)
class _MonitorUpdate:
    """Formulas about a look at the state, by a monitor that reads these variables."""

    variables: tuple[str, ...]

    @property
    def gap(self) -> str:
        """Some reading did not speak until now."""
        return smt_or(
            f"(not (or (= ({one}.spoke before) first) (and ((_ is at) ({one}.spoke before))"
            f" (<= (- now (when ({one}.spoke before))) max-age))))"
            for one in self.variables
        )

    @property
    def no_gap(self) -> str:
        """Everything was measured, without a gap."""
        return smt_and((f"(not {self.gap})", *map(self.is_measured, self.variables)))

    @staticmethod
    def is_measured(name: str) -> str:
        return f"(and {name}.serves (<= (- now {name}.time) max-age))"

    @property
    def last_times(self) -> str:
        """State the stored times of the readings that are measured now."""
        return smt_and(
            f"(= ({one}.spoke after) (ite {self.is_measured(one)} (at {one}.time) lapsed))"
            for one in self.variables
        )

    def no_earlier_sample(self, state_term: str) -> str:
        """There was no moment at which anything could have spoken."""
        return smt_and(f"(= ({one}.spoke {state_term}) first)" for one in self.variables)

    @property
    def all_stale(self) -> str:
        """Nothing that was read speaks, until it is read again."""
        return smt_and(
            f"(= ({one}.spoke after) (ite (= ({one}.spoke before) first) first lapsed))"
            for one in self.variables
        )

    @property
    def time_assumptions(self) -> dict[str, str]:
        """State that an earlier measurement has a time, a present one is true, and all others are unknown."""
        return {
            **{f"{one}-spoke": f"(not (= ({one}.spoke before) never))" for one in self.variables},
            **{
                f"{one}-is-true": smt_implies(self.is_measured(one), f"(= {one}.held {one}.value)")
                for one in self.variables
            },
        }


_CLOCK: Final = "(<= (latest before) now 9007199254740992)"
_LATER: Final = "(and (<= now later) (<= (latest before) later))"

# `since`, and `once` of it.


@dataclass(frozen=True)
class _SinceInvariant:
    """A condition `kept since reset`; of `once`, `kept` is true."""

    term: t.Since

    @property
    def is_once(self) -> bool:
        return self.term.sustained == t.TRUE

    @property
    def update(self) -> _MonitorUpdate:
        return _MonitorUpdate(("b",) if self.is_once else ("a", "b"))

    @property
    def sustained_term(self) -> str:
        return "true" if self.is_once else "a.held"

    def is_in_window(self, time: str, present: str) -> str:
        """State that a time lies in the window."""
        return "true" if self.term.window_s is None else f"(<= (- {present} {time}) window)"

    def definitions(self) -> tuple[str, ...]:
        """Define the stored state by the reference; `held` is of the trace before, `missed` with the gap."""
        recent = "((_ is at) time)" if self.term.window_s is None else "(is-recent time present)"
        return (
            f"(define-fun within ((time Time) (present Real)) Bool {recent})",
            "(define-fun tells ((k Kept) (is Bool) (present Real)) Bool"
            " (and (=> (within (surely k) present) is) (=> is (within (maybe k) present))))",
            "(define-fun is-time ((k Kept) (time Time)) Bool"
            " (or (= time never) (and ((_ is at) time) (<= (when time) (latest k)))))",
            "(define-fun in-order ((k Kept)) Bool (and (is-time k (surely k)) (is-time k (maybe k))))",
            f"(define-fun looked ((missed Bool) (present Real)) Bool {self.next_value('now', 'missed')})",
            "(define-fun may-be-missed ((held Bool) (missed Bool) (present Real)) Bool"
            f" (and (=> missed (or held {self.is_in_window('now', 'present')}))"
            f"{' (=> held missed)' if self.is_once else ''}))",
        )

    def next_value(self, at: str, before: str) -> str:
        """State the equation `since-looks-back` for a moment at that time."""
        return f"(and {self.is_in_window(at, 'present')} (or b.held (and {self.sustained_term} {before})))"


_HELD: Final = tuple(
    f"(declare-const {what}.{when} Bool)" for what in ("held", "missed") for when in ("now", "later")
)


def _since(since: _SinceInvariant, code: ModuleSource) -> TheoremObligation:
    look = since.update
    both = {"now": "now", "later": "later"}
    return TheoremObligation(
        "A look: where what was kept told of the reference, now and at any later time, it does so again,\n"
        "whatever was missed; what is said of now is so; and where all was measured, it is known.",
        (
            *past_time_monitors.TIMES,
            *past_time_monitors.monitor_state_sort(t.Since),
            *_HELD,
            *since.definitions(),
        ),
        f"(ite {_CLOCK}"
        " (and (in-order after) (= (latest after) now)"
        " (tells after (looked missed.now now) now) (tells after (looked missed.later later) later)"
        " (=> (not (= (told after) unknown)) (= (told after) (told-of (looked missed.now now))))"
        f" {look.last_times}"
        f" (=> (and {look.no_gap} (= (surely before) (maybe before)))"
        " (and (= (surely after) (maybe after)) (not (= (told after) unknown)))))"
        " (and (= (told after) unknown) (= (surely after) (surely before)) (= (maybe after) (maybe before))"
        f" (= (latest after) (latest before)) {look.all_stale}))",
        tables=(SymbolicFunction("after", "Kept", past_time_monitors.execute_step(code, since.term)),),
        assumptions={
            "in-order": f"(and (in-order before) {_LATER})",
            **{f"tells-{one}": smt_implies(_CLOCK, f"(tells before held.{one} {one})") for one in both},
            **{
                f"missed-{one}": smt_implies(
                    _CLOCK,
                    f"(ite {look.gap} (may-be-missed held.{one} missed.{one} {one})"
                    f" (= missed.{one} held.{one}))",
                )
                for one in both
            },
            **look.time_assumptions,
        },
    )


def _gap_obligation(since: _SinceInvariant, code: ModuleSource) -> TheoremObligation:
    """An induction over the moments of a gap, of which there may be any number."""
    return TheoremObligation(
        "Of a gap that ends now, `may-be-missed` allows whatever the reference makes of any number of\n"
        "moments in it: of none, and of one more.",
        (
            *past_time_monitors.TIMES,
            *past_time_monitors.monitor_state_sort(t.Since),
            *since.definitions(),
            *(f"(declare-const {name} Bool)" for name in ("held", "missed")),
            *(f"(declare-const {name} Real)" for name in ("present", "time", "one-before")),
        ),
        smt_and(
            (
                "(may-be-missed held held present)",
                f"(may-be-missed held {since.next_value('time', 'missed')} present)",
                # The reference holds of nothing that is longer ago than the window.
                smt_implies(since.next_value("time", "missed"), since.is_in_window("time", "present")),
            )
        ),
        assumptions={
            "in-the-gap": "(<= one-before time now present)",
            "so-far": "(may-be-missed held missed present)",
            "in-the-window": smt_implies("held", since.is_in_window("one-before", "present")),
        },
    )


def _since_initial(code: ModuleSource) -> TheoremObligation:
    since = _SINCE["since"]
    return TheoremObligation(
        "Before the first moment `since` holds of nothing, and nothing was missed.",
        (*past_time_monitors.TIMES, *past_time_monitors.monitor_state_sort(t.Since), *since.definitions()),
        f"(and (in-order begins) (tells begins false later) {since.update.no_earlier_sample('begins')})",
        tables=(
            SymbolicFunction("begins", "Kept", past_time_monitors.execute_initial_state(code, since.term)),
        ),
    )


# `count within`.

_COUNTED: Final = (
    *past_time_monitors.TIMES,
    *past_time_monitors.monitor_state_sort(t.Occurrences),
    *(f"(declare-const {what}.{when} Int)" for what in ("happened", "missed") for when in ("now", "later")),
    "(define-fun in-window ((time Real) (present Real)) Int (ite (<= (- present time) window) 1 0))",
    "(define-fun counted ((k Kept) (present Real)) Int"
    " (+ (ite (<= 1 (number k)) (in-window (oldest k) present) 0)"
    " (ite (<= 2 (number k)) (in-window (newest k) present) 0)))",
    "(define-fun tells ((k Kept) (happened Int) (present Real)) Bool"
    " (or (is-recent (uncounted k) present) (= happened (counted k present))))",
    "(define-fun in-order ((k Kept)) Bool (and (<= 0 (number k) 2)"
    " (=> (<= 1 (number k)) (<= (oldest k) (latest k)))"
    " (=> (<= 2 (number k)) (<= (oldest k) (newest k) (latest k)))"
    " (or (= (uncounted k) never) (and ((_ is at) (uncounted k)) (<= (when (uncounted k)) (latest k))))))",
    "(define-fun looked ((missed Int) (present Real)) Int (+ missed (ite a.held (in-window now present) 0)))",
)


def _count(code: ModuleSource) -> TheoremObligation:
    look = _MonitorUpdate(("a",))
    both = ("now", "later")
    return TheoremObligation(
        "A look: where what was kept told how often it happened in the window, now and at any later time,\n"
        "it does so again, whatever was missed; what is said of now is so; and where all was measured,\n"
        "and is no more than is kept, it is known.",
        _COUNTED,
        f"(ite {_CLOCK}"
        " (and (in-order after) (= (latest after) now)"
        " (tells after (looked missed.now now) now) (tells after (looked missed.later later) later)"
        " (=> (not (= (told after) (- 1))) (= (told after) (looked missed.now now)))"
        f" {look.last_times}"
        f" (=> (and {look.no_gap} (not (is-recent (uncounted before) now)) (<= (looked missed.now now) 2))"
        " (and (not (= (told after) (- 1))) (= (uncounted after) (uncounted before)))))"
        " (and (= (told after) (- 1)) (tells after happened.later later) (in-order after)"
        f" (= (latest after) (latest before)) {look.all_stale}))",
        tables=(
            SymbolicFunction(
                "after", "Kept", past_time_monitors.execute_step(code, t.Occurrences(_A, _WINDOW))
            ),
        ),
        assumptions={
            "in-order": f"(and (in-order before) {_LATER})",
            **{f"tells-{one}": f"(tells before happened.{one} {one})" for one in both},
            **{
                f"missed-{one}": f"(and (<= 0 happened.{one} missed.{one})"
                f" (=> (< happened.{one} missed.{one}) (and {look.gap} (<= (- {one} now) window))))"
                for one in both
            },
            **look.time_assumptions,
        },
    )


def _count_initial(code: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "Before the first moment nothing has happened, and nothing was missed.",
        _COUNTED,
        f"(and (in-order begins) (tells begins 0 later) {_MonitorUpdate(('a',)).no_earlier_sample('begins')}"
        " (= (uncounted begins) never))",
        tables=(
            SymbolicFunction(
                "begins", "Kept", past_time_monitors.execute_initial_state(code, t.Occurrences(_A, _WINDOW))
            ),
        ),
    )


# `previously`.


def _previously(code: ModuleSource) -> TheoremObligation:
    look = _MonitorUpdate(("a",))
    return TheoremObligation(
        "A look: what is said is a at the moment before, unknown where something was missed; what is kept\n"
        "of this moment is a, where that was measured.",
        (
            *past_time_monitors.TIMES,
            *past_time_monitors.monitor_state_sort(t.Previously),
            *(f"(declare-const {name} Bool)" for name in ("held", "missed")),
        ),
        f"(ite {_CLOCK}"
        " (and (= (latest after) now) (=> (not (= (told after) unknown)) (= (told after) (told-of missed)))"
        " (=> (not (= (last after) unknown)) (= (last after) (told-of a.held)))"
        f" {look.last_times}"
        f" (=> (and {look.no_gap} (not (= (last before) unknown)))"
        " (not (or (= (told after) unknown) (= (last after) unknown)))))"
        " (and (= (told after) unknown) (= (last after) (last before))"
        f" (= (latest after) (latest before)) {look.all_stale}))",
        tables=(SymbolicFunction("after", "Kept", past_time_monitors.execute_step(code, t.Previously(_A))),),
        assumptions={
            "tells": "(=> (not (= (last before) unknown)) (= (last before) (told-of held)))",
            "missed": f"(=> (not {look.gap}) (= missed held))",
            **look.time_assumptions,
        },
    )


def _previously_initial(code: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "Before the first moment nothing was so, and nothing was missed.",
        (*past_time_monitors.TIMES, *past_time_monitors.monitor_state_sort(t.Previously)),
        f"(and (= (last begins) no) {_MonitorUpdate(('a',)).no_earlier_sample('begins')})",
        tables=(
            SymbolicFunction(
                "begins", "Kept", past_time_monitors.execute_initial_state(code, t.Previously(_A))
            ),
        ),
    )


# Windows, and whole traces.


def _recent(length: Fraction, code: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        f"The code that `_is_recent` writes of {length} s: exactly where a time is that long ago at most;\n"
        "not of what never was.",
        (
            *time_windows.TIMES,
            "(declare-datatypes ((Which 0)) (((never) (first) (known))))",
            "(declare-const which Which)",
        ),
        "(= recent (or (= which first)"
        f" (and (= which known) (<= {time_windows.TIME_DIFFERENCE} {smt_literal(length)}))))",
        tables=(SymbolicFunction("recent", "Bool", past_time_monitors.execute_is_recent(code, length)),),
        assumptions=time_windows.rounding_assumptions(length),
    )


@dataclass(frozen=True)
class _TraceMeaning:
    """A condition as people write it, and what it means at the last of so many moments."""

    text: str
    length: int
    meaning: Callable[[int], str]


def _in_window(last: int, number: int) -> str:
    return f"(<= (- time.{last} time.{number}) 1.0)"


def _since_means(last: int, *, within: bool) -> str:
    return smt_or(
        smt_and(
            (
                _in_window(last, number) if within else "true",
                f"b.{number}",
                *(f"a.{after}" for after in range(number + 1, last + 1)),
            )
        )
        for number in range(last + 1)
    )


def _once_means(last: int) -> str:
    return smt_or(f"(and {_in_window(last, number)} a.{number})" for number in range(last + 1))


def _historically_means(last: int) -> str:
    return smt_and(smt_implies(_in_window(last, number), f"a.{number}") for number in range(last + 1))


def _count_means(last: int) -> str:
    each = (f"(ite (and {_in_window(last, number)} a.{number}) 1 0)" for number in range(last + 1))
    return f"(= 2 (+ {' '.join(each)}))"


def _nested_means(last: int) -> str:
    once = (f"(and {_in_window(last, number)} a.{number} b.{number - 1})" for number in range(1, last + 1))
    return f"(and {smt_or(once)} (not a.{last - 1}))"


_TRACES: Final = {
    "since": _TraceMeaning("a since within 1 s b", 3, partial(_since_means, within=True)),
    "since-ever": _TraceMeaning("a since b", 4, partial(_since_means, within=False)),
    "once": _TraceMeaning("once within 1 s a", 4, _once_means),
    "historically": _TraceMeaning("historically within 1 s a", 4, _historically_means),
    "count": _TraceMeaning("count within 1 s (a) == 2", 4, _count_means),
    "previously": _TraceMeaning("previously a", 4, lambda last: f"a.{last - 1}"),
    "nested": _TraceMeaning("once within 1 s (a and previously b) and not previously a", 3, _nested_means),
}


def _trace(trace: _TraceMeaning, code: ModuleSource) -> TheoremObligation:
    numbers = range(trace.length)
    times = [f"time.{number}" for number in numbers]
    return TheoremObligation(
        f"`{trace.text}`, as parser and type checker make it:\n"
        f"along any {trace.length} measured moments, monitors and `evaluate` say what it means.",
        (
            *past_time_monitors.TRUTH_SORT,
            *(f"(declare-const {time} Real)" for time in times),
            *(f"(declare-const {name}.{number} Bool)" for name in "ab" for number in numbers),
        ),
        f"(= found (told-of {trace.meaning(trace.length - 1)}))",
        tables=(
            SymbolicFunction(
                "found", "Told", past_time_monitors.execute_traces(code, trace.text, trace.length)
            ),
        ),
        assumptions={"in-order": f"(<= (- 9007199254740992) {' '.join(times)} 9007199254740992)"},
    )


_SINCE: Final = {
    "since": _SinceInvariant(t.Since(_A, _B, _WINDOW)),
    "since-ever": _SinceInvariant(t.Since(_A, _B, None)),
    "once": _SinceInvariant(t.Since(t.TRUE, _B, _WINDOW)),
    "once-ever": _SinceInvariant(t.Since(t.TRUE, _B, None)),
}

_OBLIGATIONS: dict[str, Callable[[ModuleSource], TheoremObligation]] = {
    "since-looks-back": partial(_since_recursion, _WINDOW),
    "since-ever-looks-back": partial(_since_recursion, None),
    "count-looks-back": _count_recursion,
    "previously-looks-back": _previously_recursion,
    **{f"{name}-missed": partial(_gap_obligation, one) for name, one in _SINCE.items()},
    **{name: partial(_since, one) for name, one in _SINCE.items()},
    "since-begins": _since_initial,
    "count-begins": _count_initial,
    "count": _count,
    "previously-begins": _previously_initial,
    "previously": _previously,
    **{f"recent-{name}": partial(_recent, length) for name, length in time_windows.LENGTHS.items()},
    **{f"traces-of-{name}": partial(_trace, one) for name, one in _TRACES.items()},
}

_LOOPS: Final = loops_of(
    "aeros.runtime.monitor.history",
    (
        "aeros.spec.expr.semantics",
        (
            "evaluate",
            "_evaluate_since",
            "_age_of_last",
        ),
    ),
)

THEOREM = Theorem(
    "every known history has the value of its definition along the whole trace, in bounded memory",
    {**_OBLIGATIONS, "loops": _LOOPS},
    (
        Mutant(
            "has-an-open-window",
            "since-looks-back",
            past_time_monitors.SEMANTICS,
            "_age_of_last(trace, end) > window_s:",
            "_age_of_last(trace, end) >= window_s:",
        ),
        Mutant(
            "counts-what-is-longer-ago",
            "count-looks-back",
            past_time_monitors.SEMANTICS,
            "if _age_of_last(looked_at, end) <= within]",
            "if _age_of_last(looked_at, end) <= 2 * within]",
        ),
        Mutant(
            "starts-again-only-where-it-is-known-not-to-be-kept",
            "since",
            past_time_monitors.HISTORY,
            "if {kept} is not True: surely{number} = -inf",
            "if {kept} is False: surely{number} = -inf",
        ),
        Mutant(
            "takes-what-nobody-measured-for-not-so",
            "once",
            past_time_monitors.HISTORY,
            "if {reset} is not False: maybe{number} = exactly",
            "if {reset} is True: maybe{number} = exactly",
        ),
        Mutant(
            "forgets-that-it-is-not-kept-any-more",
            "since-ever",
            past_time_monitors.HISTORY,
            'self.add_line(f"if {kept} is False: maybe{number} = -inf")',
            "pass",
        ),
        Mutant(
            "overlooks-a-gap",
            "once-ever",
            past_time_monitors.HISTORY,
            'f"g{number} = p{number} is None or not {spoke_until_now}"',
            'f"g{number} = p{number} is None"',
        ),
        Mutant(
            "has-readings-speak-on-while-there-is-no-time",
            "previously",
            past_time_monitors.HISTORY,
            "if p{number} != inf: p{number} = None",
            "pass",
        ),
        Mutant(
            "says-what-is-so-now",
            "previously",
            past_time_monitors.HISTORY,
            'self.add_line(f"if h{number} is not None: known[{one.declared.name!r}] = h{number}")',
            'self.add_line(f"if last{number} is not None: known[{one.declared.name!r}] = last{number}")',
        ),
        Mutant(
            "keeps-one-time-too-few",
            "count",
            past_time_monitors.HISTORY,
            'f"if len({times}) > {max_count}: ',
            'f"if len({times}) >= {max_count}: ',
        ),
        Mutant(
            "forgets-that-more-happened-than-is-kept",
            "count",
            past_time_monitors.HISTORY,
            "{uncounted} = max({uncounted}, {times}.popleft())",
            "{times}.popleft()",
        ),
        Mutant(
            "takes-a-rounded-difference-for-the-difference",
            "recent-no-double",
            past_time_monitors.HISTORY,
            'f"({quick} or (apart <= {window.maybe!r} and {spans}({time}, exactly)))"',
            'f"({quick} or apart <= {window.maybe!r})"',
        ),
        Mutant(
            "holds-where-it-held-once",
            "traces-of-historically",
            past_time_monitors.PAST_OPERATORS,
            "term = t.Not(t.Since(t.TRUE, t.Not(operands[0]), within))",
            "term = t.Not(t.Since(t.TRUE, operands[0], within))",
        ),
        Mutant(
            "keeps-one-history-for-all",
            "traces-of-nested",
            past_time_monitors.PAST_TIME,
            "if name in self._kept:\n            return self._kept[name].declared.variable",
            "if isinstance(term, t.PastTerm) and self._kept:\n"
            "            return self.collected[0].declared.variable",
        ),
        Mutant(
            "reads-for-two-histories-only",
            "loops",
            "aeros.runtime.monitor.history",
            "for history in site.histories:\n",
            "for history in site.histories[:2]:\n",
        ),
    ),
)
