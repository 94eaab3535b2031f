"""Forms as they ship, explored on the full way: what arrives at the gate is of its form, or objected to."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from fractions import Fraction
from functools import partial
from types import ModuleType, SimpleNamespace
from typing import Any, Final, cast

from aeros.runtime.gate.decision import Caller, Reason
from aeros.runtime.gate.value_check import value_checkers
from aeros.skill import Action
from aeros.spec.theorems.module_copies import ModuleSource
from aeros.spec.theorems.symbolic_execution import DecideBranch, execute_symbolically
from aeros.spec.theorems.theorem import SymbolicFunction, TheoremObligation
from proofs.lib.symbolic_requests import (
    DECLARATIONS,
    PARAMETERS,
    SPECIFICATION,
    STATE,
    STUBS,
    UNIT_RANGE,
    GivenValue,
    NamedValues,
    SymbolicRequest,
    UndeclaredValue,
    check_scalars,
    fraction_stub,
    rounding_axioms,
    type_stub,
)

VALUE_CHECK: Final = "aeros.runtime.gate.value_check"
REQUEST_CHECK: Final = "aeros.runtime.gate.request_check"
GATE: Final = "aeros.runtime.gate.gate"
CODEGEN: Final = "aeros.runtime.gate.compiled.codegen"


def validation_obligations() -> dict[str, Callable[[ModuleSource], TheoremObligation]]:
    """Everything is of its form exactly where the full way has no objection to it."""
    return {
        "request": _request,
        "time": _time,
        **{f"form-of-{name}": partial(_value, name) for name in PARAMETERS},
        "given": _given,
        "measured": _readings,
    }


def _validation_modules(code: ModuleSource) -> tuple[ModuleType, ModuleType]:
    finite = SimpleNamespace(inf=float("inf"), isfinite=lambda value: value.is_finite())
    form = code.module(VALUE_CHECK, math=finite, Fraction=fraction_stub, **STUBS)
    return form, code.module(REQUEST_CHECK, using=(form,), type=type_stub)


def _obligation(
    says: str, objects: Callable[[DecideBranch], Any], formed: str, **assumptions: str
) -> TheoremObligation:
    """That there is no objection exactly where `formed`."""
    return TheoremObligation(
        says,
        (*DECLARATIONS, *SPECIFICATION),
        f"(= nothing {formed})",
        tables=(
            SymbolicFunction(
                "nothing", "Bool", execute_symbolically(lambda ask: str(not objects(ask)).lower())
            ),
        ),
        assumptions=assumptions,
    )


def _request(code: ModuleSource) -> TheoremObligation:
    _, request_check = _validation_modules(code)
    gate = code.module(GATE)

    def run(ask: DecideBranch) -> Any:
        def text(name: str) -> Any:
            return name if ask(f"{name}.is-text") else UndeclaredValue()

        request = SymbolicRequest(ask)
        caller, action = (
            Caller(text("module"), text("skill"), cast("Any", request.inputs)),
            Action(text("kind"), cast("Any", request.parameters)),
        )
        return request_check.request_fault(
            caller if ask("caller.is-one") else UndeclaredValue(),
            request.individual_readings(("near", "lit"), gate),
            action if ask("action.is-one") else UndeclaredValue(),
            request.usage,
        )

    mappings = ("inputs", "parameters", "usage")
    named = [f"{one}.is-mapping (=> {one}.strange-name {one}.strange-name-is-text)" for one in mappings]
    named += ["readings-are-some (or as-moment (=> readings.strange-name readings.strange-name-is-text))"]
    return _obligation(
        "`request_fault` has no objection exactly where somebody asks for an action, and what should be a\n"
        "mapping by name is one; a moment is, unless it was never made.",
        run,
        f"(and caller.is-one action.is-one module.is-text skill.is-text kind.is-text {' '.join(named)})",
    )


def _time(code: ModuleSource) -> TheoremObligation:
    form, _ = _validation_modules(code)
    return _obligation(
        "`check_time` has no objection exactly where it is now a number of seconds on a clock.",
        lambda ask: form.check_time(SymbolicRequest(ask).now),
        "(is-time now)",
    )


def _value(name: str, code: ModuleSource) -> TheoremObligation:
    form = _validation_modules(code)[0].ValueChecker(PARAMETERS[name])
    return _obligation(
        f"`ValueChecker.unpack` has no objection to a value of `{name}` exactly where it has the declared\n"
        "type and is in range.",
        lambda ask: form.unpack(SymbolicRequest(ask).value(name), {}),
        f"formed.{name}",
    )


def unpacking_obligations() -> dict[str, Callable[[ModuleSource], TheoremObligation]]:
    """A value of a moment is taken apart exactly where it is of its form."""
    return {f"taking-{name}": partial(_unpacking_obligation, name) for name in PARAMETERS}


def _unpacking_obligation(name: str, code: ModuleSource) -> TheoremObligation:
    form = value_checkers(PARAMETERS)[name]
    writer = code.module(CODEGEN).FunctionWriter()
    writer.names |= STUBS
    unpack = writer.build_unpacker(form)

    def run(ask: DecideBranch) -> str:
        value = SymbolicRequest(ask).value(name)
        found = unpack(value)
        if found is None:
            return "not-taken"
        check_scalars(found)
        is_whole = found.keys() == set(form.names)
        return "taken" if is_whole and _is_number_or(value, found.values()) else "wrong"

    return TheoremObligation(
        f"The function that `FunctionWriter.build_unpacker` writes takes a value of `{name}` exactly where\n"
        "it has the declared type and is in range, and gives these very scalars.",
        (*DECLARATIONS, *SPECIFICATION, "(declare-datatypes ((Taken 0)) (((taken) (not-taken) (wrong))))"),
        f"(= found (ite formed.{name} taken not-taken))",
        tables=(SymbolicFunction("found", "Taken", execute_symbolically(run, raising="wrong")),),
    )


def _is_number_or(value: Any, scalars: Iterable[Any]) -> bool:
    return all(isinstance(one, GivenValue) or one is value for one in scalars)


def _given(code: ModuleSource) -> TheoremObligation:
    """With what a form says of a value put aside."""
    _, request_check = _validation_modules(code)

    def run(ask: DecideBranch) -> Any:
        def form(name: str, default: Any) -> Any:
            def unpack(value: Any, _: Any) -> Reason | None:
                # A default that is declared is of its form: AE111 and its like refuse any other.
                return None if value == 0.5 or ask(f"formed.{value.name}") else Reason("AE704", name, "")

            return SimpleNamespace(
                unpack=unpack, declared=SimpleNamespace(default_value=default, range=UNIT_RANGE)
            )

        given = {name: lambda name=name: GivenValue(name, ask) for name in ("speed", "size")}
        forms = {"speed": form("speed", None), "size": form("size", Fraction(1, 2))}
        return list(request_check.unpack_arguments(forms, NamedValues("parameters", ask, given), "", {}))

    return _obligation(
        "`unpack_arguments` has no objection exactly where all is there that has no default, nothing\n"
        "strange is, and each value is of its form.",
        run,
        "(and (not parameters.strange-name) has.speed formed.speed (=> has.size formed.size))",
    )


def _readings(code: ModuleSource) -> TheoremObligation:
    """With what a form says of a value put aside."""
    form, request_check = _validation_modules(code)
    gate = code.module(GATE)

    def run(ask: DecideBranch) -> Any:
        def stub(name: str) -> Any:
            def unpack(_: Any, __: Any) -> Reason | None:
                return None if ask(f"formed.{name}") else Reason("AE704", name, "")

            real = form.ValueChecker(STATE[name])
            return SimpleNamespace(unpack=unpack, declared=real.declared, surely_fresh=real.surely_fresh)

        request = SymbolicRequest(ask)
        readings = request.individual_readings(("near", "lit"), gate)
        forms = {name: stub(name) for name in ("near", "lit")}
        if readings is None:
            return ["no readings"]
        return list(request_check.unpack_readings(forms, readings, request.now, frozenset(("near",)), {}))

    return _obligation(
        "`unpack_readings` has no objection exactly where what is required is measured, no longer ago than\n"
        "its maximum age, nothing is of the future, and each value is of its form; of a moment, each in it,\n"
        "of the one time.",
        run,
        "(and (not readings.strange-name) near-serves lit-serves)",
        **{
            "now-is-a-time": "(is-time now)",
            "a-moment-is-made": "(=> as-moment moment.is-made)",
            **rounding_axioms(),
        },
    )
