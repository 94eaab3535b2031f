"""The monitor's answer at a control tick, explored: with what it evaluates, and with how a stop goes on."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, Final, cast

from aeros.runtime.gate.violation import RuleViolation
from aeros.runtime.ports import BACK_OFF
from aeros.spec.theorems.module_copies import ModuleSource, install_stubs
from aeros.spec.theorems.smtlib import smt_apply, smt_literal
from aeros.spec.theorems.symbolic_execution import DecideBranch, execute_symbolically
from aeros.spec.theorems.theorem import SymbolicFunction, TheoremObligation

MONITOR: Final = "aeros.runtime.monitor.monitor"
STOP_RECORD: Final = "aeros.runtime.monitor.stop_record"


def declare_bools(*names: str) -> tuple[str, ...]:
    """Declarations of truth values."""
    return tuple(f"(declare-const {name} Bool)" for name in names)


def broken_rule(name: str) -> RuleViolation:
    """A violation of a rule."""
    return RuleViolation(name, cast("Any", None), {})


class _Calls:
    """Calls that the code makes, each checked for the very objects that it has to pass on."""

    def __init__(self) -> None:
        self.are_wrong = False
        self.counts: dict[str, int] = {}

    def note(self, name: str, *pairs: tuple[Any, Any]) -> None:
        """Count a call; in each pair, the first has to be the second."""
        self.counts[name] = self.counts.get(name, 0) + 1
        self.are_wrong |= any(given is not wanted for given, wanted in pairs)

    def were(self, name: str) -> str:
        """Say as a literal that it was called, or not."""
        return smt_literal(name in self.counts)


_ANSWERS: Final = (
    "(declare-datatypes ((Answer 0)) (((silent) (broken) (off) (backs-off) (stays) (faulty) (wrong))))"
)
_ANSWER_NAMES: Final = {
    None: "silent",
    "rule": "broken",
    "decided-path": "off",
    BACK_OFF: "backs-off",
    "earlier": "stays",
    "input:x": "faulty",
}


def _answer(found: object) -> str:
    return _ANSWER_NAMES.get(cast("Any", found), "wrong") if isinstance(found, str | None) else "wrong"


def tick_obligation(code: ModuleSource) -> TheoremObligation:
    """With what is evaluated put aside: fast check, rules, histories, tracker and the way of a stop."""
    monitor = code.module(MONITOR)

    def run(ask: DecideBranch) -> str:
        calls, measured, known, at = _Calls(), {"x": object()}, {"h": True}, object()
        plain = {"x": object()}
        made = object.__new__(monitor.RuntimeMonitor)
        stopped = ask("stopped")

        def violation(now: Any, values: Any) -> str | None:
            calls.note("tracker", (now, at), (values, measured))
            return None if ask("follows") else "decided-path"

        def fast_check(name: str) -> Any:
            def holds(values: Any) -> bool:
                calls.note(name, (values, plain))
                return ask(name)

            return SimpleNamespace(holds=holds) if ask(f"has.{name}") else None

        def fast_check_for(values: Any) -> Any:
            calls.note("renewed", (values, measured))
            return fast_check("new-check")

        def values_of_readings(forms: Any, now: Any, values: Any) -> Any:
            calls.note("readings", (forms, "forms"), (now, at), (values, measured))
            return plain if ask("readings-are-fresh") else None

        def update_histories(now: Any, values: Any) -> Any:
            calls.note("histories", (now, at), (values, measured))
            return known

        def first_violation(now: Any, values: Any, histories: Any) -> str | None:
            calls.note("rules", (now, at), (values, measured), (histories, known))
            return None if ask("rules-hold") else "rule"

        def back_off_violation(reason: str, now: Any, values: Any, histories: Any) -> str:
            calls.note("way", (reason, "earlier"), (now, at), (values, measured), (histories, known))
            return BACK_OFF if ask("may-back-off") else "earlier"

        def begin_stop(rule: Any, now: Any) -> None:
            calls.note("stop", (now, at))
            began.append(rule)

        began: list[Any] = []
        made.stops = SimpleNamespace(
            stop=SimpleNamespace(reason="earlier") if stopped else None,
            are_open=ask("recording"),
            add=lambda values: calls.note("recorded", (values, measured)),
        )
        made.tracker = SimpleNamespace(is_idle=ask("idle"), violation=violation, deviation="deviation")
        made._has_changed = ask("changed")
        earlier = fast_check("stale-check" if made._has_changed else "old-check")
        made._holds = earlier and earlier.holds
        made._fast_check_for = fast_check_for
        made._compiled = SimpleNamespace(forms="forms")
        install_stubs(monitor, {"_values_of_readings": values_of_readings})
        made._update_histories = update_histories
        made._first_violation = first_violation
        made._back_off_violation = back_off_violation
        made.begin_stop = begin_stop
        made.violation = "earlier violation"
        found = made(at, measured)
        if calls.are_wrong or made._has_changed or began != [found] * len(began):
            return "raises"
        if found == "decided-path" and made.violation != "deviation":
            return "raises"
        return smt_apply(
            "tick", _answer(found), smt_literal(bool(began)), calls.were("histories"), calls.were("recorded")
        )

    names = ("stopped", "recording", "idle", "follows", "changed", "rules-hold", "may-back-off")
    checks = ("old-check", "new-check", "stale-check")
    return TheoremObligation(
        "`RuntimeMonitor.__call__` is silent exactly where no stop is under way, the robot follows what\n"
        "was decided, and all rules hold: those of its fast check, made for the actions that are under\n"
        "way now, of the values of fresh readings, or all one by one. Else it answers with what does not\n"
        "hold, and begins a stop. During a stop it answers what the way back from contact says. Histories\n"
        "see each tick that the fast check does not decide, and each tick of a stop is recorded.",
        (
            _ANSWERS,
            "(declare-datatypes ((Tick 0)) (((raises) (tick (answer Answer) (stops Bool) (updates Bool)"
            " (records Bool)))))",
            *declare_bools(*names, "readings-are-fresh", *checks, *(f"has.{one}" for one in checks)),
            "(define-fun on-path () Bool (or idle follows))",
            "(define-fun fast () Bool (ite changed (and has.new-check new-check)"
            " (and has.old-check old-check)))",
            "(define-fun is-fast () Bool (and on-path (not recording) readings-are-fresh fast))",
        ),
        "(and (not (= found raises)) (= (answer found) (ite stopped (ite may-back-off backs-off stays)"
        " (ite is-fast silent (ite rules-hold (ite on-path silent off) broken))))"
        " (= (stops found) (and (not stopped) (not (= (answer found) silent))))"
        " (= (updates found) (not is-fast)) (= (records found) (or recording (stops found))))",
        tables=(SymbolicFunction("found", "Tick", execute_symbolically(run, raising="raises")),),
        assumptions={"a-stop-is-recorded": "(=> stopped recording)"},
    )


_WATCHES: Final = ("first", "second", "third")


def rules_obligation(code: ModuleSource) -> TheoremObligation:
    """With the form of what is measured, and the rules of one watch, put aside."""
    monitor = code.module(MONITOR)

    def run(ask: DecideBranch) -> str:
        calls, measured, known, at = _Calls(), {"x": object()}, {"h": True}, object()
        made = object.__new__(monitor.RuntimeMonitor)
        made._watches = list(_WATCHES) if ask("watches") else []
        watches = made._watches
        made.violation = None

        def fault(now: Any, values: Any, of: Any) -> str | None:
            calls.note("fault", (now, at), (values, measured), (of, watches))
            return None if ask("measured-well") else "input:x"

        def violation(watch: str, values: Any, histories: Any) -> RuleViolation | str | None:
            calls.note(watch, (values, measured), (histories, known))
            if ask(f"{watch}.holds"):
                return None
            return broken_rule(watch) if ask(f"{watch}.is-rule") else f"input:{watch}"

        made._measurement_fault, made._violation = fault, violation
        found = made._first_violation(at, measured, known)
        if calls.are_wrong:
            return "wrong"
        if found in (None, "input:x"):
            return "silent" if found is None else "faulty"
        named = found.removeprefix("input:")
        if not found.startswith("input:") and made.violation != broken_rule(named):
            return "wrong"
        return f"broken.{named}" if named in _WATCHES else "wrong"

    first_broken = "silent"
    for watch in reversed(_WATCHES):
        first_broken = f"(ite {watch}.holds {first_broken} broken.{watch})"
    answers = " ".join(f"(broken.{watch})" for watch in _WATCHES)
    return TheoremObligation(
        "`RuntimeMonitor._first_violation` is silent exactly where nothing is under watch, or all that is\n"
        "measured can be used and every watch holds; else it answers the fault, or the first that does\n"
        "not.",
        (
            f"(declare-datatypes ((Found 0)) (((silent) (faulty) (wrong) {answers})))",
            *declare_bools("watches", "measured-well"),
            *declare_bools(*(f"{watch}.{what}" for watch in _WATCHES for what in ("holds", "is-rule"))),
        ),
        f"(= found (ite watches (ite measured-well {first_broken} faulty) silent))",
        tables=(SymbolicFunction("found", "Found", execute_symbolically(run, raising="wrong")),),
    )


def back_off_obligation(code: ModuleSource) -> TheoremObligation:
    """From the beginning of a stop, with the form of what is measured and the rules put aside."""
    monitor = code.module(MONITOR)

    def run(ask: DecideBranch) -> str:
        calls, measured, known, at = _Calls(), {"x": object()}, {"h": True}, object()
        first, rules, began = object(), object(), list[Any]()
        made = object.__new__(monitor.RuntimeMonitor)
        made._watches = ["watch", "another"]
        made._active_actions = [first, object()] if ask("active") else []
        made._compiled = SimpleNamespace(
            back_off="retreat" if ask("has-kind") else None, by_kind={"retreat": rules, "move": object()}
        )
        made.stops = SimpleNamespace(begin_stop=lambda *given: began.append(given))

        def fault(now: Any, values: Any, of: Any) -> str | None:
            calls.note("fault", (now, at), (values, measured))
            calls.are_wrong |= tuple(of) != ("watch", "another", made._back_off)
            return None if ask("measured-well") else "input:x"

        def violation(watch: Any, values: Any, histories: Any) -> RuleViolation | None:
            calls.note("rules", (values, measured), (histories, known), (watch.rules, rules))
            calls.are_wrong |= watch.actions != (first,) or watch.requested_values != {}
            return None if ask("rules-hold") else broken_rule("rule")

        made._measurement_fault, made._violation = fault, violation
        made.begin_stop("earlier", at)
        found = made._back_off_violation("earlier", at, measured, known)
        return "wrong" if calls.are_wrong or began != [("earlier", at)] else _answer(found)

    return TheoremObligation(
        "After `RuntimeMonitor.begin_stop`, `_back_off_violation` is never silent. It answers `BACK_OFF`\n"
        "exactly where the site has a kind of action for that, an action was under way, all that is\n"
        "measured can be used, and every rule of that kind holds.",
        (_ANSWERS, *declare_bools("active", "has-kind", "measured-well", "rules-hold")),
        "(= found (ite (not (and active has-kind)) stays"
        " (ite (not measured-well) faulty (ite rules-hold backs-off broken))))",
        tables=(SymbolicFunction("found", "Answer", execute_symbolically(run, raising="wrong")),),
    )


_CALLS: Final = {
    "begin-stop": lambda made: made.begin_stop("later", 0.0),
    "begin-halt": lambda made: made.begin_halt(1, "words", 0.0),
    "add": lambda made: made.add({}),
    "end-halt": lambda made: made.end_halt(1, 0.0),
    "end-stop": lambda made: made.end_stop(0.0),
    "clear": lambda made: made.clear(),
}


def stop_records_obligation(code: ModuleSource) -> TheoremObligation:
    """From every state of the records, by every call."""
    records = code.module(STOP_RECORD)

    def run(ask: DecideBranch) -> str:
        def recorder(quantities: Any, reason: str, now: float) -> Any:
            return SimpleNamespace(reason=reason, add=lambda _: None, details=lambda _: {})

        install_stubs(records, {"StopRecorder": recorder})
        made = records.StopRecords(None)
        if ask("stopped"):
            made.stop = recorder(None, "earlier", 0.0)
        made._halts = {number: recorder(None, "", 0.0) for number in (1, 2) if ask(f"halts.{number}")}
        made.are_open = made.stop is not None or bool(made._halts)
        call = next((one for one in list(_CALLS)[:-1] if ask(f"does.{one}")), "clear")
        _CALLS[call](made)
        stop = "none" if made.stop is None else made.stop.reason
        halts = smt_literal(bool(made._halts))
        return smt_apply("records", stop, halts, smt_literal(made.are_open))

    calls = list(_CALLS)[:-1]
    ends = "(and (not does.begin-stop) (not does.begin-halt) (not does.add) (not does.end-halt))"
    return TheoremObligation(
        "`StopRecords`: the record of a stop goes on under its first reason until `end_stop` or `clear`,\n"
        "by every call; and records are open exactly as long as there is one.",
        (
            "(declare-datatypes ((Stop 0)) (((none) (earlier) (later))))",
            "(declare-datatypes ((Records 0)) (((wrong) (records (stop Stop) (halts Bool) (open Bool)))))",
            *declare_bools("stopped", "halts.1", "halts.2", *(f"does.{one}" for one in calls)),
        ),
        f"(and (not (= after wrong)) (= (stop after) (ite {ends} none"
        " (ite stopped earlier (ite does.begin-stop later none))))"
        " (= (open after) (or (halts after) (not (= (stop after) none)))))",
        tables=(SymbolicFunction("after", "Records", execute_symbolically(run, raising="wrong")),),
    )
