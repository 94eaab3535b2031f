"""An attenuated action is allowed, no larger than requested, and a fixed point: theorem 5."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from types import ModuleType, SimpleNamespace
from typing import Any, Final

from aeros.spec.theorems.module_copies import ModuleSource, Mutant
from aeros.spec.theorems.smtlib import smt_apply, smt_or
from aeros.spec.theorems.symbolic_execution import DecideBranch, SymbolicValue, execute_symbolically
from aeros.spec.theorems.theorem import SymbolicFunction, Theorem, TheoremObligation
from proofs.lib import gate_model as gate
from proofs.lib.loops import loops_of

ATTENUATION = "aeros.runtime.gate.attenuation"
DOUBLES = "aeros.spec.expr.doubles"

_PARAMETERS = ("p", "r", "q")
_RULES = {"rule.a": ("p",), "rule.b": ("p", "r")}
"""Parameters that each rule reduces; no rule reduces `q`."""


def _attenuated_is_allowed(code: ModuleSource) -> TheoremObligation:
    """Decided a second time, by the same gate at the same moment."""
    ways = ("short-allows", "short-silent")
    silent_or_allows = smt_or(f"(= (short-way again) {one})" for one in ways)
    return TheoremObligation(
        "What `_Decider.decide` forwards it allows as it is when it is asked for; what it attenuates, rules\n"
        "of Φ alone stood in the way of, each of which says how.",
        (
            *gate.DECLARATIONS,
            *gate.LAYER_DEFINITIONS,
            gate.OBJECTIONS,
            *gate.DECISION,
            "(declare-const again Value)",
            "(define-fun reducible ((found Objections)) Bool (or (and (= found only-a) attenuates.rule.a)"
            " (and (= found only-b) attenuates.rule.b)"
            " (and (= found only-ab) attenuates.rule.a attenuates.rule.b)))",
        ),
        "(and (not (= first wrong)) (=> (not (= first deny)) (= second (allow again)))"
        " (=> ((_ is attenuate) first)"
        " (or (reducible (objections asked)) (reducible (unmet asked)))))",
        tables=(
            SymbolicFunction("first", "Decision", gate.execute_decision(code)),
            SymbolicFunction("second", "Decision", gate.execute_decision(code, "again")),
        ),
        assumptions={
            "again": "(= again (ite ((_ is attenuate) first) (reduced first) asked))",
            "short-way-allows": "(=> (= (short-way asked) short-allows) (= (objections asked) none))",
            "short-way-speaks": gate.FAST_PATH_ANSWERS,
            "short-way-is-complete": f"(=> (= (objections again) none) {silent_or_allows})",
        },
    )


def _attenuation_module(code: ModuleSource, names: Sequence[str], **stubs: Any) -> ModuleType:
    """The module, with terms as functions of the values by `names`, and rounding as a function."""

    def nearest_double_in_range(
        value: SymbolicValue, bounds: tuple[SymbolicValue, SymbolicValue]
    ) -> SymbolicValue:
        return SymbolicValue(smt_apply("inwards", value.term), value.ask)

    def evaluate(term: str, exact: dict[str, SymbolicValue]) -> SymbolicValue:
        return SymbolicValue(smt_apply(term, *(exact[name].term for name in names)), exact[names[0]].ask)

    return code.module(
        ATTENUATION,
        lower=lambda term: term,
        evaluate=evaluate,
        nearest_double_in_range=nearest_double_in_range,
        type=lambda _: float,
        float=lambda value: value,
        Fraction=lambda value: value,
        **stubs,
    )


def _attenuated_is_smaller(code: ModuleSource) -> TheoremObligation:
    attenuation = _attenuation_module(code, _PARAMETERS)

    def run(ask: DecideBranch) -> str:
        asked = {name: SymbolicValue(name, ask) for name in _PARAMETERS}
        rules = [
            SimpleNamespace(attenuations={"a": {name: f"{rule}.{name}" for name in reduced}})
            for rule, reduced in _RULES.items()
            if ask(f"{rule}.stands-in-the-way")
        ]
        less = attenuation.attenuate_parameters(rules, "a", asked, asked)
        return smt_apply("parameters", *(less[name].term for name in _PARAMETERS))

    declarations = [
        "(declare-datatypes ((Parameters 0)) (((parameters (p-of Real) (r-of Real) (q-of Real)))))",
        "(declare-fun inwards (Real) Real)",
        "(define-fun size ((x Real)) Real (ite (<= 0 x) x (- x)))",
        *(f"(declare-const {name} Real)" for name in _PARAMETERS),
    ]
    for rule, reduced in _RULES.items():
        declarations.append(f"(declare-const {rule}.stands-in-the-way Bool)")
        declarations += [f"(declare-fun {rule}.{name} (Real Real Real) Real)" for name in reduced]
    wanted = ["(rule.a.p p r q)", "(rule.b.r p r q)"]
    wanted += [f"(rule.b.p {first} r q)" for first in ("p", "(inwards (rule.a.p p r q))")]
    wanted += ["(rule.b.r (inwards (rule.a.p p r q)) r q)"]
    return TheoremObligation(
        "`attenuate_parameters` enlarges no parameter, whatever the rules declare, and leaves alone\n"
        "what they do not speak of.",
        declarations,
        "(and (<= (size (p-of less)) (size p)) (<= (size (r-of less)) (size r)) (= (q-of less) q))",
        tables=(SymbolicFunction("less", "Parameters", execute_symbolically(run)),),
        assumptions={
            f"inwards.{place}": f"(<= (size (inwards {one})) (size {one}))"
            for place, one in enumerate(wanted)
        },
    )


_AXES = ("v.x", "v.y", "v.z")


def _shortened_is_smaller(code: ModuleSource) -> TheoremObligation:
    def factor_to_length(vector: list[SymbolicValue], length: SymbolicValue) -> SymbolicValue:
        parts = (*(part.term for part in vector), length.term)
        return SymbolicValue(smt_apply("factor", *parts), length.ask)

    attenuation = _attenuation_module(code, _AXES, factor_to_length=factor_to_length)

    def run(ask: DecideBranch) -> str:
        asked = {name: SymbolicValue(name, ask) for name in _AXES}
        rules = [
            SimpleNamespace(attenuations={"a": {"v": rule}})
            for rule in _RULES
            if ask(f"{rule}.stands-in-the-way")
        ]
        less = attenuation.attenuate_parameters(rules, "a", {"v": tuple(asked.values())}, asked)["v"]
        return smt_apply("vector", *(one.term for one in less)) if len(less) == len(_AXES) else "other"

    declarations = [
        "(declare-datatypes ((Vector 0)) (((vector (x-of Real) (y-of Real) (z-of Real)) (other))))",
        "(declare-fun inwards (Real) Real)",
        "(declare-fun factor (Real Real Real Real) Real)",
        "(define-fun size ((x Real)) Real (ite (<= 0 x) x (- x)))",
        *(f"(declare-const {name} Real)" for name in _AXES),
        *(f"(declare-const {rule}.stands-in-the-way Bool)" for rule in _RULES),
        *(f"(declare-fun {rule} (Real Real Real) Real)" for rule in _RULES),
    ]
    # What may occur: each rule shortens what was asked for, and the second what the first has left.
    first, second = _RULES
    assumptions: dict[str, str] = {}

    def shortened(rule: str, vector: tuple[str, ...]) -> tuple[str, ...]:
        factor = smt_apply("factor", *vector, smt_apply(rule, *vector))
        assumptions[f"factor.{len(assumptions)}"] = f"(<= 0 {factor} 1)"
        scaled = [smt_apply("*", factor, part) for part in vector]
        for part, product in zip(vector, scaled, strict=True):
            inwards = smt_apply("inwards", product)
            assumptions[f"inwards.{len(assumptions)}"] = f"(<= (size {inwards}) (size {product}))"
            assumptions[f"product.{len(assumptions)}"] = (
                f"(=> (<= 0 {factor} 1) (<= (size {product}) (size {part})))"
            )
        return tuple(smt_apply("inwards", product) for product in scaled)

    shortened(second, _AXES)
    shortened(second, shortened(first, _AXES))
    claims = (f"(<= (size ({axis}-of less)) (size v.{axis}))" for axis in "xyz")
    return TheoremObligation(
        "`attenuate_parameters` enlarges no component of a vector, whatever lengths the rules declare.",
        declarations,
        f"(and (not (= less other)) {' '.join(claims)})",
        tables=(SymbolicFunction("less", "Vector", execute_symbolically(run)),),
        assumptions=assumptions,
    )


def _rounding_is_inwards(code: ModuleSource) -> TheoremObligation:
    def nextafter(value: SymbolicValue, towards: float) -> SymbolicValue:
        return SymbolicValue(smt_apply("above" if towards == inf else "below", value.term), value.ask)

    doubles = code.module(
        DOUBLES,
        float=lambda value: SymbolicValue(smt_apply("nearest", value.term), value.ask),
        Fraction=lambda value: value,
        nextafter=nextafter,
    )

    def run(ask: DecideBranch) -> str:
        value, size = SymbolicValue("wanted", ask), SymbolicValue("(size wanted)", ask)
        found: Any = doubles.nearest_double_in_range(value, (-size, size))
        return str(found.term)

    return TheoremObligation(
        "`nearest_double_in_range` makes of a real a double that is no larger.",
        [
            "(define-fun size ((x Real)) Real (ite (<= 0 x) x (- x)))",
            "(declare-const wanted Real)",
            *(f"(declare-fun {name} (Real) Real)" for name in ("nearest", "above", "below")),
            "(define-fun found.nearest () Real (nearest wanted))",
        ],
        "(<= (size found) (size wanted))",
        tables=(SymbolicFunction("found", "Real", execute_symbolically(run)),),
        assumptions={
            # IEEE 754: no double is between a real and the double nearest to it, and 0 is one.
            "least-above": "(=> (< wanted found.nearest) (<= (below found.nearest) wanted))",
            "largest-below": "(=> (< found.nearest wanted) (<= wanted (above found.nearest)))",
            "zero": "(and (=> (< 0 found.nearest) (<= 0 (below found.nearest)))"
            " (=> (< found.nearest 0) (<= (above found.nearest) 0)))",
            "order": "(and (=> (<= 0 wanted) (<= 0 found.nearest)) (=> (<= wanted 0) (<= found.nearest 0)))",
        },
    )


_LOOPS: Final = loops_of(
    "aeros.runtime.gate.gate",
    "aeros.runtime.gate.attenuation",
)

THEOREM = Theorem(
    "an attenuated action is allowed, larger in no parameter, and not attenuated further",
    {
        "allowed": _attenuated_is_allowed,
        "no-larger": _attenuated_is_smaller,
        "no-longer": _shortened_is_smaller,
        "rounded-inwards": _rounding_is_inwards,
        "loops": _LOOPS,
    },
    (
        Mutant(
            "attenuates-where-a-rule-does-not-say-how",
            "allowed",
            gate.GATE,
            "return rules if all(kind in rule.attenuations for rule in rules) else []",
            "return rules",
        ),
        Mutant(
            "forwards-an-action-that-would-be-reduced-again",
            "allowed",
            gate.GATE,
            "if not self._objections(caller, readings, reduced, now, usage, {}):",
            "if self._attenuating_rules(kind, self._objections(caller, readings, reduced, now, usage, {})):",
        ),
        Mutant(
            "enlarges-as-a-rule-declares",
            "no-larger",
            ATTENUATION,
            "if size < abs(exact[name]):",
            "if size != abs(exact[name]):",
        ),
        Mutant(
            "adds-what-was-scaled-to-a-vector",
            "no-longer",
            ATTENUATION,
            "_towards_zero(factor * exact[axis]) for axis in axes",
            "_towards_zero(exact[axis] + factor * exact[axis]) for axis in axes",
        ),
        Mutant(
            "rounds-to-the-nearest-double",
            "rounded-inwards",
            DOUBLES,
            "            return nextafter(nearest, -inf)\n        if Fraction(nearest) < lower",
            "            return nearest\n        if Fraction(nearest) < lower",
        ),
        Mutant(
            "reduces-by-two-rules-only",
            "loops",
            "aeros.runtime.gate.attenuation",
            "    for rule in rules:\n",
            "    for rule in rules[:2]:\n",
        ),
    ),
)
