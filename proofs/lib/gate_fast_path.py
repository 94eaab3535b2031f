"""The short way as it ships, explored: it answers only where everything is well-formed, and what holds."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache, partial
from types import SimpleNamespace
from typing import Any, Final, cast

from aeros.runtime.gate.decision import Decision, Reason, Verdict
from aeros.runtime.gate.value_check import forms_of
from aeros.skill import Action
from aeros.spec.backends.compiled import Truths
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.model.model import Declared, Quota
from aeros.spec.theorems.module_copies import Code
from aeros.spec.theorems.symbolic_execution import Ask, Diagram, explore
from aeros.spec.theorems.theorem import Obligation, Table
from proofs.lib.symbolic_requests import (
    DECLARATIONS,
    INPUT,
    PARAMETERS,
    REQUIRED,
    SPECIFICATION,
    STANDS_FOR,
    STATE,
    Measured,
    Request,
    look_at,
    rounding,
    whole,
)

STRAIGHT: Final = "aeros.runtime.gate.compiled.fast_path"
WRITING: Final = "aeros.runtime.gate.compiled.codegen"

MOMENT_IS_TAKEN: Final = "(=> moment.is-taken (and (not readings.strange-name){}))".format(
    "".join(f" (=> has.{name} formed.{name})" for name in STATE)
)
"""What `MomentTaker.scalars` takes apart, is of its form: see `gate_moments.py`."""

_QUOTA: Final = Quota("rate", frozenset(("a",)), 3, Fraction(60), cast("Any", None))

_SHORT: Final = (
    "(declare-datatypes ((ShortWay 0))"
    " (((short-allows) (short-denies) (short-leaves) (short-silent) (wrong))))"
)


@dataclass(frozen=True, eq=False)
class _Shape:
    """What a skill and a kind declare: a part of all types, as every value doubles the ways through.

    formed: what must be so of a request that is answered.
    """

    name: str
    parameters: Mapping[str, Declared]
    inputs: Mapping[str, Declared]
    state: Mapping[str, Declared]
    formed: Sequence[str]


def _shape(name: str, parameters: Sequence[str], inputs: Sequence[str], state: Sequence[str]) -> _Shape:
    mappings = ["parameters", "inputs", "usage"]
    formed = ["(is-time now)", "has.rate", "((_ is a-whole) used)", "(<= 0 (whole used))"]
    formed += [f"{one}.is-mapping (not {one}.strange-name)" for one in mappings]
    formed += ["readings-are-some (not readings.strange-name)"]
    formed += [f"has.{one} formed.{one}" for one in (*parameters, *inputs)]
    formed += [f"{one}-serves" for one in state]
    return _Shape(
        name,
        {one: PARAMETERS[one] for one in parameters},
        dict.fromkeys(inputs, INPUT),
        {one: STATE[one] for one in state},
        formed,
    )


_SHAPES: Final = (
    _shape("parameters", ("speed", "gently", "tool"), (), ()),
    _shape("inputs", ("times",), ("size",), ("lit",)),
    _shape("vectors", ("place",), (), ()),
    _shape("readings", (), (), ("near", "warm")),
)


def short_way_obligations(
    claim: Callable[[_Shape], Obligation],
) -> dict[str, Callable[[Code], Obligation]]:
    """What `claim` says of the short way of each shape; `found` is what that says."""

    def made(shape: _Shape, code: Code) -> Obligation:
        return replace(claim(shape), tables=(Table("found", "ShortWay", _explore_short_way(code, shape)),))

    return {f"short-way-{shape.name}": partial(made, shape) for shape in _SHAPES}


_HOLDS: Final = f"(and allows (< (number used) {_QUOTA.at_most}) envelope left)"
"""What the short way has to decide by."""


def allows_only_what_holds(shape: _Shape) -> Obligation:
    """Where it speaks, all is well-formed; where it allows, all that it evaluates holds."""
    return Obligation(
        "The function that `compile_straight` writes answers only where everything is well-formed, readings\n"
        "one by one or of one moment, and allows only what is asked for, where quotas are left and envelope\n"
        "and residue hold of these very values.",
        (*DECLARATIONS, *SPECIFICATION, _SHORT),
        "(and (not (= found wrong))"
        f" (or (= found short-silent) (and {' '.join(shape.formed)}))"
        f" (=> (= found short-allows) {_HOLDS}))",
        assumptions={**rounding(), "moment-is-taken": MOMENT_IS_TAKEN},
    )


def allows_what_holds(_: _Shape) -> Obligation:
    """Where it speaks, it allows what it finds to hold."""
    return Obligation(
        "The function that `compile_straight` writes is silent, or allows, where quotas are left and\n"
        "envelope and residue hold.",
        (*DECLARATIONS, *SPECIFICATION, _SHORT),
        f"(=> {_HOLDS} (or (= found short-allows) (= found short-silent)))",
    )


@cache
def _explore_short_way(code: Code, shape: _Shape) -> Diagram:
    """What the function that `compile_straight` writes says of any request: a term of sort ShortWay."""
    answers: list[Ask] = []
    written = {
        allows: _short_way(code, shape, allows, lambda question: answers[-1](question))
        for allows in (True, False)
    }

    def run(ask: Ask) -> str:
        answers.append(ask)
        request = Request(ask)
        parameters = request.parameters.only(shape.parameters)
        found = written[ask("allows")](
            request.inputs.only(shape.inputs),
            request.readings.only(shape.state),
            parameters,
            request.now,
            request.usage,
        )
        match found:
            case None:
                return "short-silent"
            case Decision(Verdict.ALLOW, Action("a", executed), ()):
                return "short-allows" if _is_what_was_asked(executed, shape.parameters) else "wrong"
            case Decision(Verdict.DENY, None, _):
                return "short-denies"
            case dict():
                look_at(found)
                return "short-leaves"
            case _:
                return "wrong"

    return explore(run, raising="wrong")


def _short_way(code: Code, shape: _Shape, allows: bool, ask: Ask) -> Any:
    """The function as it is written, with conditions, the denial and what looks at types put aside."""
    straight = code.module(STRAIGHT, using=(code.module(WRITING),))
    known = (*shape.parameters, *shape.inputs, *(REQUIRED & shape.state.keys()))

    def conditions(writer: Any, terms: Sequence[str], _: Any) -> list[str]:
        read = ", ".join(
            f"{name!r}: {local}" for name, local in writer.local.items() if root_of(name) in known
        )
        return [f"holds({term!r}, {{{read}}})" for term in terms]

    def holds(term: str, read: Mapping[str, Any]) -> bool:
        look_at(read)
        return ask(term)

    straight._Writer.conditions = conditions

    def denying(_: Any) -> Decision | None:
        return None if ask("attenuates") else Decision(Verdict.DENY, None, (Reason("AE750", "", ""),))

    rules = Truths((), lambda: (ask("rules"),))
    criteria = straight.Criteria(allows, "envelope", "permission", "left", rules, denying)
    state, required = forms_of(shape.state), REQUIRED & shape.state.keys()
    one_by_one = straight.compile_one_by_one(state, required)
    function = straight.compile_straight(
        criteria,
        inputs=forms_of(shape.inputs),
        state=state,
        moments=SimpleNamespace(scalars=Measured.scalars),
        one_by_one=one_by_one,
        required=required,
        parameters=forms_of(shape.parameters),
        quotas=(_QUOTA,),
        kind="a",
    )
    # Its globals are what the writer gave it; denials are kept by hash, which questions have none of.
    stubs = {**STANDS_FOR, "whole": whole, "denying": denying}
    unknown = stubs.keys() - function.__globals__.keys()
    if unknown:
        raise InternalError(f"the short way does not use {sorted(unknown)} any more")
    function.__globals__.update(stubs, holds=holds)
    one_by_one.__globals__.update(stubs)
    return function


def root_of(scalar: str) -> str:
    """The variable that it is a scalar of, as it is declared."""
    return scalar.removesuffix(".x").removesuffix(".y").removesuffix(".z")


def _is_what_was_asked(executed: Mapping[str, Any], parameters: Iterable[str]) -> bool:
    """Whether the plant would be given each parameter as it was asked for; of numbers, which these are."""

    def named(value: Any) -> Any:
        return tuple(map(named, value)) if isinstance(value, tuple) else getattr(value, "name", None)

    numbers = {"speed": "speed", "times": "times", "place": ("place.x", "place.y", "place.z")}
    return executed.keys() == set(parameters) and all(
        named(value) == numbers.get(name) for name, value in executed.items()
    )
