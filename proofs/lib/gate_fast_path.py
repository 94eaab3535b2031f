"""The short way as it ships, explored: it answers only where everything is well-formed, and what holds."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache, partial
from types import SimpleNamespace
from typing import Any, Final, cast

from aeros.runtime.gate.decision import Decision, DecisionKind, Reason
from aeros.runtime.gate.value_check import value_checkers
from aeros.skill import Action
from aeros.spec.backends.compiled import CompiledConditions
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.model.policy import Quota
from aeros.spec.model.variables import Declared
from aeros.spec.theorems.module_copies import ModuleSource
from aeros.spec.theorems.symbolic_execution import DecideBranch, DecisionDiagram, execute_symbolically
from aeros.spec.theorems.theorem import SymbolicFunction, TheoremObligation
from proofs.lib.symbolic_requests import (
    DECLARATIONS,
    INPUT,
    PARAMETERS,
    REQUIRED,
    SPECIFICATION,
    STATE,
    STUBS,
    MeasuredReadings,
    SymbolicRequest,
    check_scalars,
    rounding_axioms,
)

FAST_PATH: Final = "aeros.runtime.gate.compiled.fast_path"
CODEGEN: Final = "aeros.runtime.gate.compiled.codegen"

SNAPSHOT_IS_UNPACKED: Final = "(=> moment.is-taken (and (not readings.strange-name){}))".format(
    "".join(f" (=> has.{name} formed.{name})" for name in STATE)
)
"""A value that `SnapshotCache.scalars` unpacks is well-formed: see `gate_snapshots.py`."""

_QUOTA: Final = Quota("rate", frozenset(("a",)), 3, Fraction(60), cast("Any", None))

_FAST_PATH_SORT: Final = (
    "(declare-datatypes ((ShortWay 0))"
    " (((short-allows) (short-denies) (short-leaves) (short-silent) (wrong))))"
)


@dataclass(frozen=True, eq=False)
class _RequestShape:
    """Declared values of a skill and a kind: not all types at once, as each value doubles the paths.

    formed: what must be so of a request that is answered.
    """

    name: str
    parameters: Mapping[str, Declared]
    inputs: Mapping[str, Declared]
    state: Mapping[str, Declared]
    well_formed: Sequence[str]


def _make_shape(
    name: str, parameters: Sequence[str], inputs: Sequence[str], state: Sequence[str]
) -> _RequestShape:
    mappings = ["parameters", "inputs", "usage"]
    formed = ["(is-time now)", "has.rate", "((_ is a-whole) used)", "(<= 0 (whole used))"]
    formed += [f"{one}.is-mapping (not {one}.strange-name)" for one in mappings]
    formed += ["readings-are-some (not readings.strange-name)"]
    formed += [f"has.{one} formed.{one}" for one in (*parameters, *inputs)]
    formed += [f"{one}-serves" for one in state]
    return _RequestShape(
        name,
        {one: PARAMETERS[one] for one in parameters},
        dict.fromkeys(inputs, INPUT),
        {one: STATE[one] for one in state},
        formed,
    )


_SHAPES: Final = (
    _make_shape("parameters", ("speed", "gently", "tool"), (), ()),
    _make_shape("inputs", ("times",), ("size",), ("lit",)),
    _make_shape("vectors", ("place",), (), ()),
    # A part of the next one, in a seventh of its paths: quick for mutants that need no second reading.
    _make_shape("reading", (), (), ("near",)),
    _make_shape("readings", (), (), ("near", "warm")),
)


def fast_path_obligations(
    claim: Callable[[_RequestShape], TheoremObligation],
) -> dict[str, Callable[[ModuleSource], TheoremObligation]]:
    """Make the obligation `claim` for the fast path of each shape; `found` is the fast path's result."""

    def made(shape: _RequestShape, code: ModuleSource) -> TheoremObligation:
        return replace(
            claim(shape), tables=(SymbolicFunction("found", "ShortWay", _execute_fast_path(code, shape)),)
        )

    return {f"short-way-{shape.name}": partial(made, shape) for shape in _SHAPES}


_HOLDS: Final = f"(and allows (< (number used) {_QUOTA.max_count}) envelope left)"
"""Conditions that the fast path has to decide by."""


def allow_implies_conditions(shape: _RequestShape) -> TheoremObligation:
    """Claim that an answer implies well-formed values, and an allowance implies the evaluated conditions."""
    return TheoremObligation(
        "The function that `compile_fast_path` writes answers only where everything is well-formed,\n"
        "readings one by one or of one moment, and allows only what is asked for, where quotas are\n"
        "left and envelope and residue hold of these very values.",
        (*DECLARATIONS, *SPECIFICATION, _FAST_PATH_SORT),
        "(and (not (= found wrong))"
        f" (or (= found short-silent) (and {' '.join(shape.well_formed)}))"
        f" (=> (= found short-allows) {_HOLDS}))",
        assumptions={**rounding_axioms(), "moment-is-taken": SNAPSHOT_IS_UNPACKED},
    )


def conditions_imply_allow(_: _RequestShape) -> TheoremObligation:
    """Claim that the fast path, if it answers, allows an action whose conditions hold."""
    return TheoremObligation(
        "The function that `compile_fast_path` writes is silent, or allows, where quotas are left and\n"
        "envelope and residue hold.",
        (*DECLARATIONS, *SPECIFICATION, _FAST_PATH_SORT),
        f"(=> {_HOLDS} (or (= found short-allows) (= found short-silent)))",
    )


@cache
def _execute_fast_path(code: ModuleSource, shape: _RequestShape) -> DecisionDiagram:
    """Execute the function that `compile_fast_path` generates on any request: a term of sort ShortWay."""
    answers: list[DecideBranch] = []
    written = {
        allows: _fast_path(code, shape, allows, lambda question: answers[-1](question))
        for allows in (True, False)
    }

    def run(ask: DecideBranch) -> str:
        answers.append(ask)
        request = SymbolicRequest(ask)
        parameters = request.parameters.restricted_to(shape.parameters)
        found = written[ask("allows")](
            request.inputs.restricted_to(shape.inputs),
            request.readings.restricted_to(shape.state),
            parameters,
            request.now,
            request.usage,
        )
        match found:
            case None:
                return "short-silent"
            case Decision(DecisionKind.ALLOW, Action("a", executed), ()):
                return "short-allows" if _parameters_unchanged(executed, shape.parameters) else "wrong"
            case Decision(DecisionKind.DENY, None, _):
                return "short-denies"
            case dict():
                check_scalars(found)
                return "short-leaves"
            case _:
                return "wrong"

    return execute_symbolically(run, raising="wrong")


def _fast_path(code: ModuleSource, shape: _RequestShape, allows: bool, ask: DecideBranch) -> Any:
    """The function as it is written, with conditions, the denial and what looks at types put aside."""
    fast_path = code.module(FAST_PATH, using=(code.module(CODEGEN),))
    known = (*shape.parameters, *shape.inputs, *(REQUIRED & shape.state.keys()))

    def condition_codes(writer: Any, terms: Sequence[str], _: Any) -> list[str]:
        read = ", ".join(
            f"{name!r}: {local}" for name, local in writer.local.items() if scalar_root(name) in known
        )
        return [f"holds({term!r}, {{{read}}})" for term in terms]

    def holds(term: str, read: Mapping[str, Any]) -> bool:
        check_scalars(read)
        return ask(term)

    fast_path._FastPathWriter.condition_codes = condition_codes

    def denying(_: Any) -> Decision | None:
        return None if ask("attenuates") else Decision(DecisionKind.DENY, None, (Reason("AE750", "", ""),))

    rules = CompiledConditions((), lambda: (ask("rules"),))
    criteria = fast_path.DecisionCriteria(allows, "envelope", "permission", "left", rules, denying)
    state, required = value_checkers(shape.state), REQUIRED & shape.state.keys()
    read_each = fast_path.compile_read_each(state, required)
    function = fast_path.compile_fast_path(
        criteria,
        inputs=value_checkers(shape.inputs),
        state=state,
        snapshot_cache=SimpleNamespace(scalars=MeasuredReadings.scalars),
        read_each=read_each,
        required=required,
        parameters=value_checkers(shape.parameters),
        quotas=(_QUOTA,),
        kind="a",
    )
    # Its globals are what the writer gave it; denials are kept by hash, which questions have none of.
    stubs = {**STUBS, "denying": denying}
    unknown = stubs.keys() - function.__globals__.keys()
    if unknown:
        raise InternalError(f"the short way does not use {sorted(unknown)} any more")
    function.__globals__.update(stubs, holds=holds)
    read_each.__globals__.update(stubs)
    return function


def scalar_root(scalar: str) -> str:
    """The variable that it is a scalar of, as it is declared."""
    return scalar.removesuffix(".x").removesuffix(".y").removesuffix(".z")


def _parameters_unchanged(executed: Mapping[str, Any], parameters: Iterable[str]) -> bool:
    """State that the plant gets each parameter, a number, as it was requested."""

    def named(value: Any) -> Any:
        return tuple(map(named, value)) if isinstance(value, tuple) else getattr(value, "name", None)

    numbers = {"speed": "speed", "times": "times", "place": ("place.x", "place.y", "place.z")}
    return executed.keys() == set(parameters) and all(
        named(value) == numbers.get(name) for name, value in executed.items()
    )
