"""Values of a control tick, explored: those that can be used, and those that rules are evaluated with."""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any, Final, cast

from aeros.runtime.ports import Reading
from aeros.spec.theorems.module_copies import ModuleSource
from aeros.spec.theorems.smtlib import smt_and, smt_apply, smt_literal
from aeros.spec.theorems.symbolic_execution import DecideBranch, execute_symbolically
from aeros.spec.theorems.theorem import SymbolicFunction, TheoremObligation
from proofs.monitor.tick_answers import MONITOR, declare_bools


class _Origin:
    """A value of one variable, by where it comes from."""

    def __init__(self, of: str, origin: str) -> None:
        self.of, self.origin = of, origin


def _scalars(of: str, origin: str) -> dict[str, Any]:
    return {of: _Origin(of, origin)}


# The values that rules are evaluated with.

_READ: Final = ("a", "b")
_ORIGINS: Final = ("requested", "now", "before", "decided", "kept", "known", "absent", "wrong")


def _values_of_watch(ask: DecideBranch) -> dict[str, Any] | None:
    """Values that earlier ticks left, or None before the first evaluation of a watch."""
    if not ask("evaluated-before"):
        return None
    values = _scalars("p", "requested") | (_scalars("h", "before") if ask("h.was-known") else {})
    for name in _READ:
        if ask(f"{name}.was-there"):
            values |= _scalars(name, "before")
    return values


def values_obligation(code: ModuleSource) -> TheoremObligation:
    """With the unpacking of one value, and the rules, put aside."""
    monitor = code.module(MONITOR)

    def run(ask: DecideBranch) -> str:
        decided = {name: object() for name in _READ}

        def unpack(name: str, value: Any) -> Mapping[str, Any] | None:
            if name == "h":
                return _scalars("h", "known") if value is True else None
            if value is not decided[name]:
                return _scalars(name, "wrong")
            return _scalars(name, "decided") if ask(f"{name}.decided-is-formed") else None

        def first_violation(values: Mapping[str, Any]) -> str:
            origins = [values[name].origin if name in values else "absent" for name in ("p", *_READ, "h")]
            mixed = any(one.of != name for name, one in values.items())
            return smt_apply("values", *(["wrong"] * 4 if mixed else origins))

        def kept_value(name: str) -> Any:
            """The value that was checked last: what is measured now, or at an earlier time."""
            same = ask(f"{name}.decided-is-kept")
            return SimpleNamespace(
                value=decided[name] if same else object(),
                scalars=_scalars(name, "now" if name in measured else "kept"),
            )

        rules = SimpleNamespace(reads=(*_READ, "h"), first_violation=first_violation)
        readings = {name: Reading(decided[name], 0.0) for name in _READ if ask(f"{name}.was-decided")}
        other = SimpleNamespace(readings={name: Reading(object(), 0.0) for name in _READ})
        watch = monitor._MonitoredActions(
            (SimpleNamespace(readings=readings), other), rules, _scalars("p", "requested")
        )
        watch.values = _values_of_watch(ask)
        measured = {name: object() for name in _READ if ask(f"{name}.is-measured")}
        made = object.__new__(monitor.RuntimeMonitor)
        made._histories = SimpleNamespace(names=frozenset("h"))
        made._checked_values = {name: kept_value(name) for name in _READ}
        unpackers = {name: (lambda value, name=name: unpack(name, value)) for name in (*_READ, "h")}
        made._compiled = SimpleNamespace(unpackers=unpackers)
        known = {"h": True} if ask("h.is-known") else {}
        found = cast("str", made._violation(watch, measured, known))
        return found if watch.requested_values.keys() == {"p"} else "raises"

    def expected(name: str) -> str:
        decided = (
            f"(ite (not {name}.was-decided) absent (ite {name}.decided-is-kept kept"
            f" (ite {name}.decided-is-formed decided absent)))"
        )
        earlier = f"(ite evaluated-before (ite {name}.was-there before absent) {decided})"
        return f"(= (value-of-{name} found) (ite {name}.is-measured now {earlier}))"

    asked = ("was-there", "was-decided", "decided-is-kept", "decided-is-formed", "is-measured")
    return TheoremObligation(
        "`RuntimeMonitor._violation` evaluates the rules with the requested parameters, with what is\n"
        "measured at this tick, and else with what the action was decided on; with a history's value only\n"
        "if it is known at this tick.",
        (
            f"(declare-datatypes ((Origin 0)) (({' '.join(f'({one})' for one in _ORIGINS)})))",
            "(declare-datatypes ((Values 0)) (((raises) (values (value-of-p Origin) (value-of-a Origin)"
            " (value-of-b Origin) (value-of-h Origin)))))",
            *declare_bools("evaluated-before", "h.was-known", "h.is-known"),
            *declare_bools(*(f"{name}.{what}" for name in _READ for what in asked)),
        ),
        smt_and(
            (
                "(not (= found raises))",
                "(= (value-of-p found) requested)",
                *map(expected, _READ),
                "(= (value-of-h found) (ite h.is-known known absent))",
            )
        ),
        tables=(SymbolicFunction("found", "Values", execute_symbolically(run, raising="raises")),),
        assumptions={
            f"what-is-measured-is-not-what-was-decided.{name}": f"(not (and {name}.is-measured"
            f" {name}.decided-is-kept))"
            for name in _READ
        },
    )


def histories_obligation(code: ModuleSource) -> TheoremObligation:
    """With the histories themselves put aside: `past_time` is about these."""
    monitor = code.module(MONITOR)

    def run(ask: DecideBranch) -> str:
        at, times = object(), {name: object() for name in _READ}
        values = {name: object() for name in _READ}
        measured = {
            name: Reading(values[name], cast("float", times[name]))
            if ask(f"{name}.is-reading")
            else values[name]
            for name in _READ
            if ask(f"{name}.is-measured")
        }
        earlier = Reading("earlier", 0.0)
        made = object.__new__(monitor.RuntimeMonitor)
        made._readings = dict.fromkeys((*_READ, "other"), earlier)
        advanced: list[Any] = []

        def advance(readings: Mapping[str, Reading], now: object) -> dict[str, bool]:
            advanced.append((dict(readings), now))
            return {"h": True}

        names = frozenset("h") if ask("has-histories") else frozenset()
        made._histories = SimpleNamespace(names=names, advance=advance)
        found = made._update_histories(at, measured)
        if not names:
            return "none" if found == {} and not advanced else "raises"
        ((readings, now),) = advanced
        if now is not at or found != {"h": True} or readings.pop("other") != earlier:
            return "raises"

        def origin(name: str) -> str:
            reading = readings[name]
            if reading is earlier:
                return "earlier"
            if reading.value is not values[name]:
                return "wrong"
            return {id(at): "of-tick", id(times[name]): "of-reading"}.get(id(reading.time), "wrong")

        return smt_apply("updated", *map(origin, _READ))

    def expected(name: str) -> str:
        return f"(ite {name}.is-measured (ite {name}.is-reading of-reading of-tick) earlier)"

    return TheoremObligation(
        "`RuntimeMonitor._update_histories` advances the histories once, to the time of the tick, with each\n"
        "value that is measured, at its own time or that of the tick; and else with the reading that it had.",
        (
            "(declare-datatypes ((Given 0)) (((earlier) (of-tick) (of-reading) (wrong))))",
            "(declare-datatypes ((Update 0)) (((raises) (none) (updated (a Given) (b Given)))))",
            *declare_bools("has-histories"),
            *declare_bools(*(f"{name}.{of}" for name in _READ for of in ("is-measured", "is-reading"))),
        ),
        f"(= found (ite has-histories (updated {' '.join(map(expected, _READ))}) none))",
        tables=(SymbolicFunction("found", "Update", execute_symbolically(run, raising="raises")),),
    )


# Which values can be used.

_MEASURED: Final = ("a", "m.b", "m.c")
"""A variable of the site, and two of a module, which perhaps no rule reads."""


class _EqualValue:
    """A value that equals any other, as 1 equals True: that does not make it well-formed."""

    __hash__ = None  # type: ignore[assignment]

    def __eq__(self, other: object) -> bool:
        return True


def measured_obligation(code: ModuleSource) -> TheoremObligation:
    """With the check of one value put aside: see `usable_obligation`."""
    monitor = code.module(MONITOR)

    def run(ask: DecideBranch) -> str:
        at, wrong = object(), list[str]()
        kept = {name: _EqualValue() for name in _MEASURED}
        measured = {
            name: kept[name] if ask(f"{name}.is-same") else _EqualValue()
            for name in _MEASURED
            if ask(f"{name}.is-measured")
        }

        def is_usable(name: str, value: Any, now: Any) -> bool:
            if value is not measured[name] or now is not at:
                wrong.append(name)
            return ask(f"{name}.can-be-used")

        made = object.__new__(monitor.RuntimeMonitor)
        made._is_usable = is_usable
        made._measured = frozenset(name for name in _MEASURED if ask(f"{name}.was-measured"))
        made._checked_values = {name: monitor._CheckedValue(kept[name], {}) for name in _MEASURED}
        made._has_changed, before = False, made._measured
        watches = [
            SimpleNamespace(
                rules=SimpleNamespace(reads=tuple(x for x in _MEASURED[1:] if ask(f"{x}.{which}-reads")))
            )
            for which in ("first", "second")
        ]
        fault = made._measurement_fault(at, measured, watches)
        if wrong or fault not in (None, *(f"input:{name}" for name in _MEASURED)):
            return "wrong"
        if fault is not None:
            return f"fault.{fault.removeprefix('input:')}"
        if not (made._has_changed or made._measured == before):
            return "wrong"
        return smt_apply("usable", *(smt_literal(name in made._measured) for name in _MEASURED))

    asked = ("was-measured", "is-measured", "is-same", "can-be-used", "first-reads", "second-reads")
    faults = " ".join(f"(fault.{name})" for name in _MEASURED)
    kept_names = " ".join(f"(asks-for-{name} Bool)" for name in _MEASURED)
    return TheoremObligation(
        "`RuntimeMonitor._measurement_fault` is None exactly where every variable that a rule reads, and\n"
        "that the tick before measured, is measured, and every value is the one that was checked last, or\n"
        "can be used; of a module's variable that no rule reads, nothing is asked. What is measured is\n"
        "then asked for at the next tick; if that differs, the next tick chooses its fast check anew.",
        (
            f"(declare-datatypes ((Found 0)) (((wrong) {faults} (usable {kept_names}))))",
            *declare_bools(*(f"{name}.{what}" for name in _MEASURED for what in asked)),
            "(define-fun a.is-read () Bool true)",
            *(
                f"(define-fun {name}.is-read () Bool (or {name}.first-reads {name}.second-reads))"
                for name in _MEASURED[1:]
            ),
            *(
                f"(define-fun {name}.is-missing () Bool (and {name}.was-measured (not {name}.is-measured)"
                f" {name}.is-read))"
                for name in _MEASURED
            ),
            *(
                f"(define-fun {name}.is-wrong () Bool (and {name}.is-measured {name}.is-read"
                f" (not (or {name}.is-same {name}.can-be-used))))"
                for name in _MEASURED
            ),
        ),
        smt_and(
            (
                "(= ((_ is usable) found)"
                f" (not (or {' '.join(f'{x}.is-missing {x}.is-wrong' for x in _MEASURED)})))",
                *(f"(=> (= found fault.{x}) (or {x}.is-missing {x}.is-wrong))" for x in _MEASURED),
                "(not (= found wrong))",
                *(
                    f"(=> (and ((_ is usable) found) {x}.is-measured {x}.is-read) (asks-for-{x} found))"
                    for x in _MEASURED
                ),
            )
        ),
        tables=(SymbolicFunction("found", "Found", execute_symbolically(run, raising="wrong")),),
    )


def readings_obligation(code: ModuleSource) -> TheoremObligation:
    """With the age of a reading put aside; the gate's theorems are about that."""

    def run(ask: DecideBranch) -> str:
        at, wrong = object(), list[str]()
        values = {name: object() for name in _READ}
        times = {name: cast("float", object()) for name in _READ}
        measured = {
            name: Reading(values[name], times[name]) if ask(f"{name}.is-reading") else values[name]
            for name in _READ
            if ask(f"{name}.is-measured")
        }

        def is_reading(of: Any) -> bool:
            for name in _READ:
                if of is measured.get(name):
                    return ask(f"{name}.is-whole")
            wrong.append("reading")
            return False

        def check_freshness(checker: str, measured_at: Any, now: Any, required: bool) -> str | None:
            name = checker.removeprefix("checker of ")
            if measured_at is not times[name] or now is not at or not required:
                wrong.append("age")
            return None if ask(f"{name}.is-fresh") else "too old"

        monitor = code.module(MONITOR, is_reading=is_reading, check_freshness=check_freshness)
        forms = {name: f"checker of {name}" for name in _READ if ask(f"{name}.is-declared")}
        given = dict(measured)
        found = monitor._values_of_readings(forms, at, measured)
        # What is measured is others', too.
        if wrong or any(measured[name] is not one for name, one in given.items()):
            return "wrong"
        if found is None:
            return "refused"
        right = found.keys() == given.keys() and all(found[name] is values[name] for name in found)
        return "values" if right else "wrong"

    asked = ("is-measured", "is-reading", "is-declared", "is-whole", "is-fresh")
    usable = (
        f"(=> (and {name}.is-measured {name}.is-reading)"
        f" (and {name}.is-declared {name}.is-whole {name}.is-fresh))"
        for name in _READ
    )
    return TheoremObligation(
        "`monitor._values_of_readings` gives each value that is measured, and for a reading its\n"
        "value, exactly where each reading is whole, of a declared variable, not of the future and fresh.",
        (
            "(declare-datatypes ((Found 0)) (((values) (refused) (wrong))))",
            *declare_bools(*(f"{name}.{what}" for name in _READ for what in asked)),
        ),
        f"(= found (ite {smt_and(usable)} values refused))",
        tables=(SymbolicFunction("found", "Found", execute_symbolically(run, raising="wrong")),),
    )


def usable_obligation(code: ModuleSource) -> TheoremObligation:
    """With the form of a value and the age of a reading put aside; the gate's theorems are about these."""

    def run(ask: DecideBranch) -> str:
        at, time, wrong = object(), object(), list[str]()
        kept = _Origin("a", "kept")
        value: Any = kept
        if not ask("is-same"):
            value = ["a"] if ask("is-list") else _Origin("a", "now")
        given = Reading(value, cast("float", time)) if ask("is-reading") else value

        def unpack(of: Any) -> Mapping[str, Any] | None:
            if of is not value:
                wrong.append("value")
            return _scalars("a", "now") if ask("is-formed") else None

        def is_reading(of: Any) -> bool:
            if of is not given:
                wrong.append("reading")
            return ask("reading-is-whole")

        def check_freshness(checker: str, measured_at: Any, now: Any, required: bool) -> str | None:
            if (checker, measured_at, now) != ("checker of a", time, at):
                wrong.append("age")
            if not ask("is-of-past"):
                return "in the future"
            return None if not required or ask("is-young") else "too old"

        monitor = code.module(MONITOR, is_reading=is_reading, check_freshness=check_freshness)
        made = object.__new__(monitor.RuntimeMonitor)
        made._checked_values = {"a": monitor._CheckedValue(kept, _scalars("a", "kept"))}
        made._compiled = SimpleNamespace(
            forms={"a": "checker of a"} if ask("is-declared") else {}, unpackers={"a": unpack}
        )
        found = made._is_usable("a", given, at)
        checked = made._checked_values["a"]
        if wrong or found not in (True, False):
            return "wrong"
        return smt_apply(
            "checked",
            smt_literal(found),
            checked.scalars["a"].origin,
            "kept" if checked.value is kept else "now" if checked.value is value else "none",
        )

    return TheoremObligation(
        "`RuntimeMonitor._is_usable` exactly where the variable is declared, the value is of its form,\n"
        "and a reading is whole, not of the future and fresh. Its scalars are then kept, with the value\n"
        "that they are of; but with none for a list, which may change. So no reading is ever taken for\n"
        "checked: its age is asked for at each tick. Otherwise what is kept stays as it was.",
        (
            "(declare-datatypes ((Origin 0)) (((now) (kept) (none))))",
            "(declare-datatypes ((Checked 0)) (((wrong) (checked (is-usable Bool) (scalars Origin)"
            " (value Origin)))))",
            *declare_bools("is-same", "is-list", "is-reading", "reading-is-whole", "is-of-past", "is-young"),
            *declare_bools("is-declared", "is-formed"),
            "(define-fun can-be-used () Bool (and is-declared (or is-same is-formed)"
            " (=> is-reading (and reading-is-whole is-of-past is-young))))",
        ),
        "(and (not (= found wrong)) (= (is-usable found) can-be-used)"
        " (= (scalars found) (ite (and can-be-used (not is-same)) now kept))"
        " (= (value found) (ite (and can-be-used (not is-same)) (ite is-list none now) kept)))",
        tables=(SymbolicFunction("found", "Checked", execute_symbolically(run, raising="wrong")),),
    )
