"""The generated check of control ticks, explored as it is written, in every state that ticks may leave."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from types import FunctionType
from typing import Any, Final, cast

from aeros.runtime.gate.value_check import value_checkers
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL, IntegerType, RealType, VectorType
from aeros.spec.expr.units import NUMBER
from aeros.spec.model.variables import Declared
from aeros.spec.theorems.module_copies import ModuleSource
from aeros.spec.theorems.smtlib import smt_and, smt_apply, smt_implies, smt_literal
from aeros.spec.theorems.symbolic_execution import DecideBranch, execute_symbolically
from aeros.spec.theorems.theorem import SymbolicFunction, TheoremObligation
from proofs.lib.symbolic_requests import DECLARATIONS, STUBS, UNIT_RANGE, GivenValue, UndeclaredValue
from proofs.monitor.rule_sets import RULES
from proofs.monitor.tick_answers import declare_bools

CODEGEN: Final = "aeros.runtime.gate.compiled.codegen"


def _variable(name: str, type_: Any, role: t.VariableRole = t.VariableRole.STATE) -> Declared:
    span = None if type_ is BOOL else UNIT_RANGE
    return Declared(t.Variable(name, type_, role), cast("Any", None), range=span)


def _real(name: str) -> t.Variable:
    return t.Variable(name, RealType(NUMBER), t.VariableRole.STATE)


def _constant(quarters: int) -> t.Literal:
    return t.Literal(Fraction(quarters, 4), RealType(NUMBER))


@dataclass(frozen=True, eq=False)
class _TickRule:
    """A rule: its term, the scalars that it reads, the same as code, and as a formula."""

    term: t.Term
    reads: tuple[str, ...]
    decide: Callable[..., bool]
    formula: str


_SPEED: Final = _real("speed")


@dataclass(frozen=True, eq=False)
class _TickShape:
    """Measured variables of some types, and rules on them: not all at once, as each doubles the paths.

    scalars: of each variable; vectors have several.
    kept: variables whose last value the check remembers.
    """

    name: str
    declared: tuple[Declared, ...]
    scalars: Mapping[str, tuple[str, ...]]
    kept: tuple[str, ...]
    rules: tuple[_TickRule, ...]


_SCALARS: Final = _TickShape(
    "numbers",
    (_variable("near", RealType(NUMBER)), _variable("warm", RealType(NUMBER)), _variable("lit", BOOL)),
    {"near": ("near",), "warm": ("warm",), "lit": ("lit",)},
    ("near", "lit"),
    (
        _TickRule(
            t.And(
                (t.Compare("<=", _constant(1), _real("warm")), t.Compare("<=", _real("warm"), _constant(3)))
            ),
            ("warm",),
            lambda warm: warm >= 0.25 and warm <= 0.75,
            "(and (leq (a-double (/ 1 4)) {warm}) (leq {warm} (a-double (/ 3 4))))",
        ),
        _TickRule(
            t.Compare("<=", _SPEED, t.Add(_real("near"), _constant(1))),
            ("near", "speed"),
            lambda near, speed: speed <= near,
            "(leq {speed} {near})",
        ),
        _TickRule(
            t.Compare("<=", _real("cold"), t.Add(_real("near"), _constant(2))),
            ("cold", "near"),
            lambda cold, near: cold <= near,
            "(leq {cold} {near})",
        ),
        _TickRule(
            t.Implies(
                t.Variable("lit", BOOL, t.VariableRole.STATE),
                t.Compare("<=", _constant(1), t.Add(_real("near"), _constant(0))),
            ),
            ("lit", "near"),
            lambda lit, near: not lit or near >= 0.25,
            "(=> {lit} (leq (a-double (/ 1 4)) {near}))",
        ),
    ),
)

_PLACE: Final = ("place.x", "place.y", "place.z")
_VECTORS: Final = _TickShape(
    "vectors",
    (_variable("place", VectorType(NUMBER)), _variable("count", IntegerType(NUMBER))),
    {"place": _PLACE, "count": ("count",)},
    ("place",),
    (
        _TickRule(
            t.Compare("<=", t.Add(_real("place.x"), _constant(1)), _SPEED),
            ("place.x", "speed"),
            lambda x, speed: x <= speed,
            "(leq {place.x} {speed})",
        ),
        _TickRule(
            t.Compare("<=", t.Add(_real("place.z"), _constant(1)), _constant(5)),
            ("place.z",),
            lambda z: z <= 0.5,
            "(leq {place.z} (a-double (/ 1 2)))",
        ),
        _TickRule(
            t.And(
                (t.Compare("<=", _constant(0), _real("count")), t.Compare("<=", _real("count"), _constant(4)))
            ),
            ("count",),
            lambda count: count >= 0.0 and count <= 1.0,
            "(and (leq (a-double 0.0) {count}) (leq {count} (a-double 1.0)))",
        ),
        _TickRule(
            t.Compare("<=", _SPEED, _constant(3)),
            ("speed",),
            lambda speed: speed <= 0.75,
            "(leq {speed} (a-double (/ 3 4)))",
        ),
    ),
)

_GIVEN: Final = ("speed", "cold")
"""Scalars of the decision: a parameter, and a state variable that no tick measures."""


class _CellAccess:
    """Variables that outlast a call of a generated function."""

    def __init__(self, function: Any) -> None:
        self._cells = dict(
            zip(
                cast("FunctionType", function).__code__.co_freevars,
                cast("FunctionType", function).__closure__ or (),
                strict=True,
            )
        )

    def set(self, name: str, value: Any) -> None:
        """Put a value into a variable."""
        self._cells[name].cell_contents = value

    def get(self, name: str) -> Any:
        """Read a variable."""
        return self._cells[name].cell_contents


class _WrittenCheck:
    """The check of a shape, with the names of the local variables that it keeps."""

    def __init__(self, code: ModuleSource, shape: _TickShape, ask: DecideBranch) -> None:
        rules = code.module(RULES, using=(code.module(CODEGEN),))
        self.flags: dict[str, tuple[int, ...]] = {}
        self.local: dict[str, str] = {}

        def condition_codes(writer: Any, terms: Sequence[t.Term], _: Any) -> list[str]:
            self.local = dict(writer.local)
            numbers = [next(n for n, rule in enumerate(shape.rules) if rule.term is one) for one in terms]
            return [
                f"holds_{n}({', '.join(writer.local[scalar] for scalar in shape.rules[n].reads)})"
                for n in numbers
            ]

        def decide(writer: Any, codes: Sequence[str], flag: str | None) -> None:
            if flag is not None:
                self.flags[flag] = tuple(int(one.partition("(")[0].removeprefix("holds_")) for one in codes)
            shipped(writer, codes, flag)

        writer_class = rules._TickCheckWriter
        writer_class.condition_codes = condition_codes
        shipped, writer_class._decide = writer_class._decide, decide
        parameters = tuple(_variable(name, RealType(NUMBER)) for name in _GIVEN)
        checkers = value_checkers({one.variable.name: one for one in shape.declared})
        made = writer_class().build_fast_check(
            [rule.term for rule in shape.rules], (*shape.declared, *parameters), checkers
        )
        unknown = STUBS.keys() - made.__globals__.keys()
        if unknown:
            raise InternalError(f"the check of ticks does not use {sorted(unknown)} any more")
        made.__globals__.update(STUBS)
        made.__globals__.update({f"holds_{n}": rule.decide for n, rule in enumerate(shape.rules)})
        self.unset = made.__globals__["nothing"]
        self.check = made()
        self.state = _CellAccess(self.check.holds)


def _value(ask: DecideBranch, shape: _TickShape, name: str) -> Any:
    """A value of any form that was measured now."""
    scalars = shape.scalars[name]
    if name == "lit":
        return ask("lit") if ask("lit.is-flag") else UndeclaredValue()
    if len(scalars) == 1:
        return GivenValue(name, ask)
    if not ask(f"{name}.is-list"):
        return UndeclaredValue()
    parts = [GivenValue(scalar, ask) for scalar in scalars]
    listed = parts if ask(f"{name}.has-three") else parts[:2]
    return tuple(listed) if ask(f"{name}.is-tuple") else listed


def _earlier(ask: DecideBranch, shape: _TickShape, name: str) -> tuple[Any, list[Any]]:
    """The value that the check remembers, which is of its form, and its scalars."""
    if name == "lit":
        return (flag := ask("was.lit")), [flag]
    scalars = [GivenValue(f"was.{scalar}", ask, double=True) for scalar in shape.scalars[name]]
    return (scalars[0] if len(scalars) == 1 else tuple(scalars)), scalars


def _ticks(shape: _TickShape, code: ModuleSource) -> TheoremObligation:
    answers: list[DecideBranch] = []
    written = _WrittenCheck(code, shape, lambda question: answers[-1](question))
    used = sorted({name for rule in shape.rules for name in rule.reads} & {*_GIVEN})

    def run(ask: DecideBranch) -> str:
        answers.append(ask)
        state, earlier = written.state, dict[str, Any]()
        for number, name in enumerate(shape.scalars):
            if name in shape.kept:
                value, scalars = _earlier(ask, shape, name)
                remembers = ask(f"remembers.{name}")
                earlier[name] = value if remembers else written.unset
                state.set(f"last{number}", earlier[name])
                for scalar, one in zip(shape.scalars[name], scalars, strict=True):
                    # What is not remembered may have left anything.
                    state.set(written.local[scalar], one if remembers else UndeclaredValue())
        for name in used:
            state.set(written.local[name], GivenValue(name, ask, double=True))
        for flag in written.flags:
            state.set(flag, ask(f"{flag}"))
        measured = {
            name: earlier[name]
            if name in shape.kept and earlier[name] is not written.unset and ask(f"{name}.is-same")
            else _value(ask, shape, name)
            for name in shape.scalars
            if ask(f"measures.{name}")
        }
        if ask("measures-more"):
            measured["more"] = 0.0
        found = written.check.holds(measured)
        if found not in (True, False):
            return "wrong"
        fields = [smt_literal(found)]
        for number, name in enumerate(shape.scalars):
            if name not in shape.kept:
                continue
            last = state.get(f"last{number}")
            kept = [state.get(written.local[scalar]) for scalar in shape.scalars[name]]
            fields.append(_kept_field(shape, name, last, kept, earlier, measured, written.unset))
        return smt_apply("tick", *fields, *(smt_literal(state.get(flag) is True) for flag in written.flags))

    diagram = execute_symbolically(run, raising="raises")
    return TheoremObligation(
        f"The check of ticks that `_TickCheckWriter` writes, of {' and '.join(shape.scalars)}: it holds only"
        " where\nexactly these are measured, each of its form, and each rule holds of what is measured and"
        " decided.\nWhat it remembers for the next tick is of its form, with its own scalars; and a flag that"
        " a rule still\nholds is true only where it does.",
        _tick_declarations(shape, written.flags),
        _tick_claim(shape, written.flags),
        tables=(SymbolicFunction("found", "Found", diagram),),
        assumptions={
            **{
                f"what-is-remembered-is-formed.{name}": smt_implies(
                    f"remembers.{name}", _formed(shape, name, "was.")
                )
                for name in shape.kept
                if name != "lit"
            },
            **{f"given-is-a-number.{name}": f"((_ is a-double) {name})" for name in used},
            **{
                f"{flag}-is-right": _flag_claim(shape, flag, numbers, _before(shape), "remembers.{}")
                for flag, numbers in written.flags.items()
            },
        },
    )


def _kept_field(
    shape: _TickShape,
    name: str,
    last: Any,
    kept: Sequence[Any],
    earlier: Mapping[str, Any],
    measured: Mapping[str, Any],
    unset: object,
) -> str:
    if last is unset:
        return "unset"
    if name == "lit":
        return "wrong-one" if not isinstance(last, bool) or kept != [last] else ("yes" if last else "no")
    if last is earlier[name] and last is not measured.get(name, last):
        origin = "earlier"
    elif last is measured.get(name) and not isinstance(last, list):
        origin = "earlier" if last is earlier[name] else "current"
    else:
        origin = "earlier" if last is earlier[name] and name not in measured else "wrong-one"
    prefix = "was." if origin == "earlier" else ""
    names = [f"{prefix}{scalar}" for scalar in shape.scalars[name]]
    return origin if [getattr(one, "name", None) for one in kept] == names else "wrong-one"


def _formed(shape: _TickShape, name: str, prefix: str) -> str:
    if name == "lit":
        return "true" if prefix else "lit.is-flag"
    numbers = smt_and(f"(in-unit {prefix}{scalar})" for scalar in shape.scalars[name])
    if name == "count":
        return smt_and((numbers, f"(is_int (number {prefix}count))"))
    is_compound = len(shape.scalars[name]) > 1 and not prefix
    return smt_and((f"{name}.is-list", f"{name}.has-three", numbers)) if is_compound else numbers


def _tick_declarations(shape: _TickShape, flags: Iterable[str]) -> tuple[str, ...]:
    scalars = [one for name in shape.scalars for one in shape.scalars[name]]
    numbers = [one for one in scalars if one != "lit"]
    known = "\n".join(DECLARATIONS)
    new = [
        one for one in (*numbers, *(f"was.{one}" for one in numbers), *_GIVEN) if f"const {one} " not in known
    ]
    fields = " ".join(f"(kept-{name} Origin)" for name in shape.kept)
    flag_fields = " ".join(f"({flag}-after Bool)" for flag in flags)
    truths = [f"measures.{name}" for name in shape.scalars] + ["measures-more", "lit", "was.lit"]
    truths += [f"{what}{name}" for name in shape.kept for what in ("remembers.",)]
    truths += [f"{name}.is-same" for name in shape.kept]
    return (
        *(line for line in DECLARATIONS if not line.startswith("(declare-const lit ")),
        *(f"(declare-const {one} Given)" for one in new),
        *declare_bools(*truths, *flags),
        "(define-fun exact ((x Given)) Bool (and (is-number x)"
        " (=> ((_ is a-whole) x) (<= (- 9007199254740992) (whole x) 9007199254740992))))",
        "(define-fun in-unit ((x Given)) Bool (and (exact x) (<= 0 (number x) 1)))",
        "(declare-datatypes ((Origin 0)) (((unset) (earlier) (current) (yes) (no) (wrong-one))))",
        f"(declare-datatypes ((Found 0)) (((wrong) (raises) (tick (holds Bool) {fields} {flag_fields}))))",
        *(
            f"(define-fun same.{name} () Bool"
            + (f" (and remembers.{name} {name}.is-same))" if name in shape.kept else " false)")
            for name in shape.scalars
        ),
        *(
            f"(define-fun value.{scalar} () {'Bool' if scalar == 'lit' else 'Given'}"
            f" {f'(ite same.{name} was.{scalar} {scalar})' if name in shape.kept else scalar})"
            for name in shape.scalars
            for scalar in shape.scalars[name]
        ),
    )


def _before(shape: _TickShape) -> dict[str, str]:
    return {scalar: f"was.{scalar}" for scalars in shape.scalars.values() for scalar in scalars}


def _formula(rule: _TickRule, values: Mapping[str, str]) -> str:
    formula = rule.formula
    for scalar in rule.reads:
        formula = formula.replace(f"{{{scalar}}}", values.get(scalar, scalar))
    return formula


def _flag_claim(
    shape: _TickShape, flag: str, numbers: Sequence[int], values: Mapping[str, str], known: str
) -> str:
    """A flag that is true: the rules hold of the remembered values, if all that they read is remembered."""
    read = {scalar for n in numbers for scalar in shape.rules[n].reads}
    kept = [name for name in shape.kept if read & {*shape.scalars[name]}]
    rules = smt_and(_formula(shape.rules[n], values) for n in numbers)
    return smt_implies(smt_and((flag, *(known.format(name) for name in kept))), rules)


def _tick_claim(shape: _TickShape, flags: Mapping[str, tuple[int, ...]]) -> str:
    now = {scalar: f"value.{scalar}" for name in shape.scalars for scalar in shape.scalars[name]}
    every = [
        smt_and((f"measures.{name}", f"(or same.{name} {_formed(shape, name, '')})"))
        for name in shape.scalars
    ]
    holds = smt_and((*every, "(not measures-more)", *(_formula(rule, now) for rule in shape.rules)))
    claims = ["(not (= found raises))", "(not (= found wrong))", f"(= (holds found) {holds})"]
    after = dict(now)
    for name in shape.kept:
        kept = f"(kept-{name} found)"
        if name == "lit":
            claims.append(f"(not (= {kept} wrong-one))")
            after["lit"] = f"(= {kept} yes)"
            continue
        claims.append(f"(or (= {kept} unset) (and (= {kept} earlier) remembers.{name})")
        claims[-1] += f" (and (= {kept} current) {_formed(shape, name, '')}))"
        for scalar in shape.scalars[name]:
            after[scalar] = f"(ite (= {kept} current) {scalar} was.{scalar})"
    claims += [
        _flag_claim(shape, f"({flag}-after found)", numbers, after, "(not (= (kept-{} found) unset))")
        for flag, numbers in flags.items()
    ]
    return smt_and(claims)


def tick_code_obligations() -> dict[str, Callable[[ModuleSource], TheoremObligation]]:
    """Make the obligations on the generated check of each shape."""
    return {f"ticks-of-{one.name}": partial(_ticks, one) for one in (_SCALARS, _VECTORS)}


def decided_obligation(code: ModuleSource) -> TheoremObligation:
    """With numbers alone, as nothing looks at them."""
    written = _WrittenCheck(code, _SCALARS, lambda _: True)

    def run(ask: DecideBranch) -> str:
        for flag in written.flags:
            written.state.set(flag, ask(flag))
        values = {name: f"decided {name}" for name in _GIVEN if ask(f"has.{name}")}
        try:
            written.check.decide(values | {"near": "decided near"})
        except KeyError:
            return "refused"
        right = all(written.state.get(written.local[name]) == values[name] for name in _GIVEN)
        flags = any(written.state.get(flag) is not False for flag in written.flags)
        return "decided" if right and not flags else "wrong"

    return TheoremObligation(
        "`decide` of the check that `_TickCheckWriter` writes keeps each parameter, and each state\n"
        "variable that rules read and no tick measures, as decided; no rule holds of them yet. It refuses\n"
        "if one is missing.",
        (
            "(declare-datatypes ((Found 0)) (((decided) (refused) (wrong))))",
            *declare_bools(*(f"has.{name}" for name in _GIVEN), *written.flags),
        ),
        f"(= found (ite {smt_and(f'has.{name}' for name in _GIVEN)} decided refused))",
        tables=(SymbolicFunction("found", "Found", execute_symbolically(run, raising="wrong")),),
    )
