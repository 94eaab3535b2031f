"""A quota counts what was executed within its window, in bounded memory: the quotas of theorem 10."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from functools import partial
from types import ModuleType, SimpleNamespace
from typing import Any, Final, cast

from aeros.spec.model.policy import Quota
from aeros.spec.theorems.module_copies import ModuleSource, Mutant
from aeros.spec.theorems.smtlib import smt_literal
from aeros.spec.theorems.symbolic_execution import DecideBranch, SymbolicValue, execute_symbolically
from aeros.spec.theorems.theorem import SymbolicFunction, Theorem, TheoremObligation
from proofs.lib import time_windows
from proofs.lib.loops import loops_of

USAGE: Final = "aeros.runtime.gate.quotas"

# A window of time.


def _window(length: Fraction, code: ModuleSource) -> TheoremObligation:
    window = time_windows.window_module(code)

    def run(ask: DecideBranch) -> str:
        made = window.TimeWindow(length)
        return smt_literal(
            bool(
                made.contains(
                    time_windows.SymbolicDouble("earlier", ask), time_windows.SymbolicDouble("later", ask)
                )
            )
        )

    bounds = time_windows.neighbouring_doubles(length)
    return TheoremObligation(
        f"`TimeWindow.contains` exactly where one time is at most {length} s after another; that is\n"
        f"{'a double' if bounds['below'] == bounds['above'] else 'no double'}.",
        time_windows.TIMES,
        f"(= spans (<= {time_windows.TIME_DIFFERENCE} {smt_literal(length)}))",
        tables=(SymbolicFunction("spans", "Bool", execute_symbolically(run)),),
        assumptions=time_windows.rounding_assumptions(length),
    )


# What is kept of the actions of one quota.

_STORED_TIMES: Final = ("first", "second")

_USAGE_SORT: Final = (
    "(declare-datatypes ((Use 0))"
    " (((use (kept Int) (first-of Real) (second-of Real) (latest-of Real)) (refused))))",
    "(declare-const before Use)",
    "(declare-const now Real)",
    "(declare-const later Real)",
    "(declare-const window Real)",
    "(declare-const governed Bool)",
    "(declare-const executed.now Int)",
    "(declare-const executed.later Int)",
    "(define-fun within ((time Real) (at Real)) Int (ite (<= (- at time) window) 1 0))",
    "(define-fun counted ((u Use) (at Real)) Int (+ (ite (<= 1 (kept u)) (within (first-of u) at) 0)"
    " (ite (<= 2 (kept u)) (within (second-of u) at) 0)))",
    "(define-fun at-most-two ((n Int)) Int (ite (<= n 2) n 2))",
    "(define-fun in-order ((u Use)) Bool (and (<= 0 (kept u) 2)"
    " (=> (<= 1 (kept u)) (<= (first-of u) (latest-of u)))"
    " (=> (<= 2 (kept u)) (<= (first-of u) (second-of u) (latest-of u)))))",
)
"""Stored usage, and the number of executed actions within the window, of any number of actions.

`executed.later` is that number at some later time, of what was executed before this step.
"""

_INVARIANT: Final = {
    "in-order": "(and (not (= before refused)) (in-order before) (<= now later) (<= 0 window))",
    "counts": "(and (<= 0 executed.now) (<= 0 executed.later) (= (counted before later) (at-most-two"
    " executed.later)))",
    "counts-now": "(=> (<= (latest-of before) now) (= (counted before now) (at-most-two executed.now)))",
}
"""Invariants of the stored usage, now and at any later time."""


def _symbolic_usage(ask: DecideBranch, usage: ModuleType) -> Any:
    """A usage in any state, of a quota of two actions."""
    made = usage.QuotaUsageCounter((Quota("q", frozenset(("a",)), 2, Fraction(1), cast("Any", None)),))
    number = 2 if ask("(= (kept before) 2)") else 1 if ask("(= (kept before) 1)") else 0
    made._times["q"].extend(SymbolicValue(f"({name}-of before)", ask) for name in _STORED_TIMES[:number])
    made._latest = SymbolicValue("(latest-of before)", ask)
    return made


def _state(made: Any) -> str:
    times = [one.term for one in made._times["q"]]
    return f"(use {len(times)} {' '.join([*times, '0.0', '0.0'][:2])} {made._latest.term})"


def _copy_usage(code: ModuleSource) -> ModuleType:
    def window(_: Fraction) -> Any:
        def contains(earlier: SymbolicValue, later: SymbolicValue) -> bool:
            return later.ask(f"(<= (- {later.term} {earlier.term}) window)")

        return SimpleNamespace(contains=contains)

    return code.module(USAGE, TimeWindow=window, type=lambda _: float, float=float, isfinite=lambda _: True)


def _executed(code: ModuleSource) -> TheoremObligation:
    usage = _copy_usage(code)

    def run(ask: DecideBranch) -> str:
        made = _symbolic_usage(ask, usage)
        try:
            made.count_execution("a" if ask("governed") else "b", SymbolicValue("now", ask))
        except usage.ClockError:
            return "refused"
        return _state(made)

    return TheoremObligation(
        "After `QuotaUsageCounter.count_execution`, what is kept still tells at any later time how many\n"
        "actions the window holds, up to the quota's number, however many there have been; a clock\n"
        "that goes back is refused.",
        _USAGE_SORT,
        "(ite (< now (latest-of before)) (= after refused)"
        " (and (not (= after refused)) (in-order after) (= (latest-of after) now)"
        " (= (counted after later) (at-most-two (+ executed.later (ite governed (within now later) 0))))))",
        tables=(SymbolicFunction("after", "Use", execute_symbolically(run)),),
        assumptions=_INVARIANT,
    )


def _count(code: ModuleSource) -> TheoremObligation:
    usage = _copy_usage(code)

    def run(ask: DecideBranch, encode: Callable[[Any, int], str]) -> str:
        made = _symbolic_usage(ask, usage)
        try:
            found = made.usage_at(SymbolicValue("now", ask))["q"]
        except usage.ClockError:
            return encode(None, -1)
        return encode(made, found)

    def state(made: Any, _: int) -> str:
        return "refused" if made is None else _state(made)

    def number(_: Any, found: int) -> str:
        return smt_literal(found)

    return TheoremObligation(
        "`QuotaUsageCounter.usage_at` says how many actions the window holds now, up to the quota's\n"
        "number; and forgets none that a later window could hold.",
        _USAGE_SORT,
        "(ite (< now (latest-of before)) (= after refused)"
        " (and (= told (at-most-two executed.now)) (not (= after refused)) (in-order after)"
        " (= (counted after later) (at-most-two executed.later))))",
        tables=(
            SymbolicFunction("told", "Int", execute_symbolically(partial(run, encode=number))),
            SymbolicFunction("after", "Use", execute_symbolically(partial(run, encode=state))),
        ),
        assumptions=_INVARIANT,
    )


def _initial_obligation(code: ModuleSource) -> TheoremObligation:
    usage = _copy_usage(code)

    def run(ask: DecideBranch) -> str:
        made = usage.QuotaUsageCounter((Quota("q", frozenset(("a",)), 2, Fraction(1), cast("Any", None)),))
        made._latest = SymbolicValue("now", ask)
        return _state(made)

    return TheoremObligation(
        "Before anything was executed, nothing is kept, and that counts as nothing.",
        _USAGE_SORT,
        "(and (in-order begins) (= (counted begins later) 0))",
        tables=(SymbolicFunction("begins", "Use", execute_symbolically(run)),),
    )


# Other quotas, after the site has changed.

_CHANGED_QUOTAS: Final = {
    "other-name": Quota("other", frozenset(("a",)), 2, Fraction(1), cast("Any", None)),
    "other-kinds": Quota("q", frozenset(("b",)), 2, Fraction(1), cast("Any", None)),
    "other-number": Quota("q", frozenset(("a",)), 3, Fraction(1), cast("Any", None)),
    "other-window": Quota("q", frozenset(("a",)), 2, Fraction(2), cast("Any", None)),
}
"""Quotas that differ from the one counted, each in one part."""


def _changed(code: ModuleSource) -> TheoremObligation:
    usage = _copy_usage(code)

    def run(ask: DecideBranch) -> str:
        made = _symbolic_usage(ask, usage)
        (same,) = made._quotas
        chosen = next((one for name, one in _CHANGED_QUOTAS.items() if ask(name)), same)
        other = made.set_quotas((chosen,))
        times = other._times.pop(chosen.id)
        return _state(SimpleNamespace(_times={"q": times}, _latest=other._latest))

    return TheoremObligation(
        "After `QuotaUsageCounter.set_quotas`, a quota that was there before, equal in every part,\n"
        "counts on; any other begins with nothing. The clock goes on.",
        (*_USAGE_SORT, *(f"(declare-const {name} Bool)" for name in _CHANGED_QUOTAS)),
        "(and (not (= after refused)) (= (latest-of after) (latest-of before))"
        f" (ite (or {' '.join(_CHANGED_QUOTAS)}) (= (kept after) 0)"
        " (and (= (kept after) (kept before)) (= (counted after later) (counted before later)))))",
        tables=(SymbolicFunction("after", "Use", execute_symbolically(run)),),
        assumptions=_INVARIANT,
    )


# Several quotas.

_QUOTAS: Final = ("p", "q")


class _Kinds(frozenset[str]):
    """The kinds of a quota: whether the kind of the action is one of them is asked for."""

    quota: str
    ask: DecideBranch

    def __contains__(self, _: object) -> bool:
        return self.ask(f"{self.quota}.governs")


def _each_quota(code: ModuleSource) -> TheoremObligation:
    usage = _copy_usage(code)

    def run(ask: DecideBranch) -> str:
        kinds = {name: _Kinds() for name in _QUOTAS}
        for name, one in kinds.items():
            one.quota, one.ask = name, ask
        quotas = [Quota(name, kinds[name], 2, Fraction(1), cast("Any", None)) for name in _QUOTAS]
        made = usage.QuotaUsageCounter(quotas)
        now, before = SymbolicValue("now", ask), SymbolicValue("latest", ask)
        made._latest = before
        try:
            made.count_execution("a", now)
            counted = dict(made.usage_at(now))
        except usage.ClockError:
            return "refused"
        kept = [made._times[name] for name in _QUOTAS]
        if made._latest is not now or any(time is not now for times in kept for time in times):
            return "others"
        return f"(counted {' '.join(str(counted[name]) for name in _QUOTAS)})"

    return TheoremObligation(
        "`QuotaUsageCounter.count_execution` counts an action once in each quota of its kind, and in no\n"
        "other, and `usage_at` says so of each.",
        (
            "(declare-datatypes ((Counted 0)) (((counted (of-p Int) (of-q Int)) (refused) (others))))",
            *(f"(declare-const {name}.governs Bool)" for name in _QUOTAS),
            "(declare-const now Real)",
            "(declare-const latest Real)",
            "(declare-const window Real)",
        ),
        "(= found (ite (< now latest) refused (counted (ite p.governs 1 0) (ite q.governs 1 0))))",
        tables=(SymbolicFunction("found", "Counted", execute_symbolically(run)),),
        assumptions={"a-window": "(<= 0.0 window)"},
    )


_LOOPS: Final = loops_of(
    "aeros.runtime.gate.quotas",
)

THEOREM = Theorem(
    "a quota counts exactly the actions in its time window, in bounded memory",
    {
        "begins": _initial_obligation,
        "executed": _executed,
        "count": _count,
        "changed": _changed,
        "each-quota": _each_quota,
        **{f"window-of-{name}": partial(_window, length) for name, length in time_windows.LENGTHS.items()},
        "loops": _LOOPS,
    },
    (
        Mutant(
            "keeps-one-time-too-few",
            "executed",
            USAGE,
            "deque(maxlen=quota.max_count)",
            "deque(maxlen=quota.max_count - 1)",
        ),
        Mutant(
            "forgets-what-is-in-the-window-still",
            "count",
            USAGE,
            "while times and not window.contains(times[0], at):",
            "if times and not window.contains(times[-1], at) or len(times) > 1:",
        ),
        Mutant(
            "lets-the-clock-go-back",
            "executed",
            USAGE,
            "        if at < self._latest:\n",
            "        if at < at:\n",
        ),
        Mutant(
            "takes-a-rounded-difference-for-the-difference",
            "window-of-no-double",
            time_windows.WINDOW,
            "apart < self.surely or (",
            "apart <= self.surely or (",
        ),
        Mutant(
            "has-an-open-window",
            "window-of-a-double",
            time_windows.WINDOW,
            "(earlier + share) <= 0.0",
            "(earlier + share) < 0.0",
        ),
        Mutant(
            "counts-what-is-another-quota's",
            "each-quota",
            USAGE,
            "self._times[quota.id].append(at)",
            "self._times[self._quotas[0].id].append(at)",
        ),
        Mutant(
            "keeps-the-counts-of-another-quota-of-the-same-name",
            "changed",
            USAGE,
            "            if quota in self._quotas:",
            "            if quota.id in self._times:",
        ),
        Mutant(
            "counts-for-the-first-quota-only",
            "loops",
            "aeros.runtime.gate.quotas",
            "                self._times[quota.id].append(at)\n",
            "                self._times[quota.id].append(at)\n                break\n",
        ),
    ),
)
