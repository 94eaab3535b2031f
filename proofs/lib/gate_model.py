"""The gate as it ships, explored: what its code decides, with the policy and all values uninterpreted.

Each part of `aeros/runtime/gate/gate.py` is run with what it calls put aside, and what it calls is explored
by itself.  Formulas of one part speak of the others by the same names, so that together they are the gate:

- `state`, `input`, `asked`: what is measured, what the skill was started with, what it asks for.
- `envelope`, `permission`, `rule.a`, `rule.b`: arbitrary conditions on these; two rules stand for any
  number, as the code treats each by itself.
- `proved.X`: the certificate says that condition X is proved of everything in the envelope.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from types import ModuleType, SimpleNamespace
from typing import Any, Final

from aeros.runtime.gate.conditions import ConditionValue
from aeros.runtime.gate.decision import Caller, Decision, DecisionKind, Reason
from aeros.runtime.ports import ColumnNames, Reading, Snapshot
from aeros.skill import Action
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL
from aeros.spec.obligations.claim_id import ClaimForm, ClaimId
from aeros.spec.theorems.module_copies import ModuleSource, install_stubs
from aeros.spec.theorems.smtlib import smt_and, smt_apply, smt_implies, smt_literal
from aeros.spec.theorems.symbolic_execution import (
    DecideBranch,
    DecisionDiagram,
    SymbolicValue,
    execute_symbolically,
)

GATE: Final = "aeros.runtime.gate.gate"

RULES: Final = ("rule.a", "rule.b")

REQUESTED_ACTION: Final = "asked"


@dataclass(frozen=True)
class GateVariant:
    """The configuration that a gate is made for, where that is not arbitrary.

    Attributes:
        rules: what Φ says of the kind.
        compiled: True if the gate is compiled; None for either.
        certified: True if there is a certificate that may call something proved; what it calls so has names
            that begin with `under`.
        modules: those that are active, in their order; `m` is the one that asks.
    """

    rules: tuple[str, ...] = RULES
    compiled: bool | None = None
    certified: bool = True
    name_prefix: str = ""
    modules: tuple[str, ...] = ("m",)


ANY_CONFIGURATION: Final = GateVariant()

_ATTENUATED_TERMS: Final = {("rule.a",): "less.a", ("rule.b",): "less.b", RULES: "less.ab"}
"""Terms of the attenuated action, by the violated rules."""

ATTENUATED_ACTIONS: Final = tuple(f"({less} state asked)" for less in _ATTENUATED_TERMS.values())
"""Every action other than the one asked for that could be forwarded."""

FORWARDABLE_ACTIONS: Final = (REQUESTED_ACTION, *ATTENUATED_ACTIONS)

_CONDITION_ARGUMENTS: Final[Mapping[str, tuple[str, ...]]] = {
    "envelope": ("inputs.i", "s", "p"),
    "permission": ("inputs.i", "s", "p"),
    **dict.fromkeys(RULES, ("s", "p")),
    "other.envelope": ("inputs.i", "s", "p"),
    "other.permission": ("inputs.i", "s", "p"),
}
"""The scalar variables that each condition is about: input, state and parameters."""

_RESIDUE: Final = "residue"

DECLARATIONS: Final = (
    "(declare-sort Value 0)",
    "(declare-const state Value)",
    "(declare-const input Value)",
    "(declare-const asked Value)",
    *(
        f"(declare-fun {name} ({' '.join(['Value'] * len(read))}) Bool)"
        for name, read in _CONDITION_ARGUMENTS.items()
    ),
    *(f"(declare-fun {less} (Value Value) Value)" for less in _ATTENUATED_TERMS.values()),
    *(f"(declare-const {whose}permission-declared Bool)" for whose in ("", "other.")),
    "(declare-const compiled Bool)",
    *(
        f"(declare-const {under}proved.{name} Bool)"
        for under in ("", "fewer.", "other.")
        for name in ("permission", *RULES)
    ),
    *(f"(declare-fun gives-up.{name} (Value) Bool)" for name in (*_CONDITION_ARGUMENTS, _RESIDUE)),
    *(f"(declare-const attenuates.{rule} Bool)" for rule in RULES),
    "(declare-const readings-made Bool)",
    "(declare-const rest-formed Bool)",
    "(define-fun request-formed () Bool (and readings-made rest-formed))",
    "(declare-const time-formed Bool)",
    "(declare-fun parameters-formed (Value) Bool)",
    "(declare-const inputs-formed Bool)",
    "(declare-const readings-serve Bool)",
    "(declare-const finite-layers-pass Bool)",
)
"""Declarations that every formula about the gate may use."""


LAYER_DEFINITIONS: Final = (
    "(define-fun well-formed ((x Value)) Bool (and (parameters-formed x) inputs-formed readings-serve))",
    "(define-fun inside ((x Value)) Bool (envelope input state x))",
    "(define-fun permitted ((x Value)) Bool (and permission-declared (permission input state x)))",
    "(define-fun obeys-a ((x Value)) Bool (rule.a state x))",
    "(define-fun obeys-b ((x Value)) Bool (rule.b state x))",
    "(define-fun passes ((x Value)) Bool (and (well-formed x) finite-layers-pass (inside x) (permitted x)"
    " (obeys-a x) (obeys-b x)))",
    "(define-fun sound ((x Value)) Bool (and request-formed time-formed (passes x)))",
)
"""Definition of a sound action, which the layers have to ensure.

A module that declares no permission for a kind has none.  `passes`: no layer objects to an action;
`sound`: what must be true of every action that is forwarded.
"""


def residue(action: str, under: str = "") -> dict[str, str]:
    """State the install-time proofs of `action`: the certificate's claims hold inside the envelope.

    As assumptions, by name.  A proof is about values of their declared forms.
    """
    claims = {"permission": "permitted", "rule.a": "obeys-a", "rule.b": "obeys-b"}
    return {
        f"{under}proof-of.{name}": f"(=> (and {under}proved.{name} (well-formed {action}) (inside {action}))"
        f" ({claim} {action}))"
        for name, claim in claims.items()
    }


SOLVER_NEVER_GIVES_UP: Final = smt_implies(
    "(not compiled)", smt_and(f"(not (gives-up.{name} asked))" for name in (*_CONDITION_ARGUMENTS, _RESIDUE))
)
"""A gate that asks Z3 each time gets an answer about the action asked for."""


class _SymbolicCondition:
    """Any condition as a gate has it compiled: a conjunction of what is uninterpreted.

    certain: compiled; a solver may give up, of which the gate must make a denial.
    """

    def __init__(self, ask: DecideBranch, term: t.Term, *, certain: bool) -> None:
        self._ask, self._certain = ask, certain
        self._parts = term.operands if isinstance(term, t.And) else (term,)
        self.names = frozenset(name for read in t.variables_of(term) for name in _CONDITION_ARGUMENTS[read])

    def decide(self, values: Mapping[str, Any]) -> ConditionValue:
        """As `Condition.decide`."""
        if not self._certain and self.names and self._ask(self._is_undecided(values)):
            return ConditionValue.UNDECIDED
        return (
            ConditionValue.HOLDS
            if all(self._is_true(part, values) for part in self._parts)
            else ConditionValue.FAILS
        )

    def _is_undecided(self, values: Mapping[str, Any]) -> str:
        names = [part.name for part in self._parts if isinstance(part, t.Variable)]
        which = names[0] if len(names) == 1 else _RESIDUE
        return smt_apply(f"gives-up.{which}", values["p"].term)

    def _is_true(self, part: t.Term, values: Mapping[str, Any]) -> bool:
        if isinstance(part, t.Literal):
            return bool(part.value)
        if not isinstance(part, t.Variable):
            raise InternalError(f"the gate made a condition that nothing here speaks of: {part}")
        return self._ask(
            smt_apply(part.name, *(values[name].term for name in _CONDITION_ARGUMENTS[part.name]))
        )


class _ProvedClaims:
    """The obligations that a certificate says are proved."""

    _CLAIMS: Final = {ClaimForm.ENVELOPE_OBEYS("k", "a", rule): rule for rule in RULES} | {
        ClaimForm.ENVELOPE_PERMITTED("k", "a"): "permission"
    }

    def __init__(self, ask: DecideBranch, under: str) -> None:
        self._ask, self._under = ask, under

    def __contains__(self, obligation: ClaimId) -> bool:
        return self._ask(f"{self._under}proved.{self._CLAIMS[obligation]}")


class _SymbolicPermission:
    """Symbolic permission of a module by action kind; the module may not mention a kind."""

    def __init__(self, ask: DecideBranch, whose: str) -> None:
        self._ask, self._whose = ask, whose

    def __contains__(self, _: str) -> bool:
        return self._ask(f"{self._whose}permission-declared")

    def __getitem__(self, _: str) -> Any:
        return SimpleNamespace(term=condition_term(f"{self._whose}permission"))


class _SymbolicAttenuations:
    """Symbolic table of the rules that declare an attenuation; `attenuated` gives the reduced action."""

    def __init__(self, ask: DecideBranch, rule: str) -> None:
        self._ask, self._rule = ask, rule

    def __contains__(self, _: str) -> bool:
        return self._ask(f"attenuates.{self._rule}")

    def get(self, _: str, default: Mapping[str, t.Term]) -> Mapping[str, t.Term]:
        """Nothing: which state it reads is of no account, as there is one state variable."""
        return default


def condition_holds(ask: DecideBranch, term: t.Term) -> bool:
    """Evaluate on the requested action a condition that code has composed of uninterpreted ones."""
    return _SymbolicCondition(ask, term, certain=True).decide(_values(ask)) is ConditionValue.HOLDS


def condition_term(name: str) -> t.Variable:
    """The uninterpreted condition of that name, as a term."""
    return t.Variable(name, BOOL, t.VariableRole.PARAMETER)


def _configuration(ask: DecideBranch, variant: GateVariant, quotas: tuple[Any, ...]) -> Any:
    """A configuration of active modules, each of whose skill `k` may ask for actions of the kind `a`."""
    rules = tuple(
        SimpleNamespace(
            id=rule,
            text=rule,
            rationale=rule,
            terms={"a": condition_term(rule)},
            attenuations=_SymbolicAttenuations(ask, rule),
        )
        for rule in variant.rules
    )
    site = SimpleNamespace(
        observed_variables={"s": SimpleNamespace(name="s")},
        module_variables=frozenset(),
        kinds={"a": SimpleNamespace(name="a", parameters={"p": SimpleNamespace(name="p")})},
        rules_for_kind=lambda _: rules,
        quotas=quotas,
    )
    modules: dict[str, Any] = {}
    for module in variant.modules:
        whose = "" if module == "m" else "other."
        skill = SimpleNamespace(
            id="k",
            inputs={"i": SimpleNamespace(name="inputs.i")},
            envelope={"a": SimpleNamespace(term=condition_term(f"{whose}envelope"))},
        )
        modules[module] = SimpleNamespace(
            id=module, skills={"k": skill}, permitted_actions=_SymbolicPermission(ask, whose)
        )

    def proved(module: str) -> Any:
        under = variant.name_prefix if module == "m" else "other."
        return _ProvedClaims(ask, under) if variant.certified else frozenset()

    return SimpleNamespace(site=site, modules=modules, proved_obligations=proved)


def _decider(
    gate: ModuleType,
    ask: DecideBranch,
    variant: GateVariant = ANY_CONFIGURATION,
    quotas: tuple[Any, ...] = (),
    **stubs: Any,
) -> Any:
    """The decider of the configuration, by this copy of the gate with what it calls put aside."""

    def finite_objections(*_: Any) -> Iterator[Reason]:
        if not ask("finite-layers-pass"):
            yield Reason("AE710", "block", "")

    install_stubs(gate, {**_gate_stubs(ask), "finite_objections": finite_objections, **stubs})
    compiled = ask("compiled") if variant.compiled is None else variant.compiled
    return gate._Decider(_configuration(ask, variant, quotas), compiled)


def _gate_stubs(ask: DecideBranch) -> dict[str, Any]:
    """Make the stubs of all functions that compile conditions and forms."""
    return {
        "CompiledCondition": lambda term, _: _SymbolicCondition(ask, term, certain=True),
        "SolverCondition": lambda term, *_: _SymbolicCondition(ask, term, certain=False),
        "JointRules": lambda *_, **__: None,
        "compile_conditions": lambda terms, _: tuple(terms),
        "compile_read_each": lambda *_: None,
        "compile_fast_path": lambda criteria, **_: criteria,
        "SnapshotCache": lambda *_: None,
        "value_checkers": lambda declared: {one.name: one.name for one in declared.values()},
        "ranges_of": lambda _: {},
    }


def _symbolic_request(
    ask: DecideBranch, action_term: str = REQUESTED_ACTION
) -> tuple[Caller, dict[str, Any], Action]:
    """Make a symbolic request: the caller, the readings and the action."""
    caller = Caller("m", "k", {"i": SymbolicValue("input", ask)})
    return caller, {"s": SymbolicValue("state", ask)}, Action("a", {"p": SymbolicValue(action_term, ask)})


class _GivenReadings:
    """Readings in either way in which they can be given, and what they are one by one."""

    def __init__(self, ask: DecideBranch) -> None:
        self._state = SymbolicValue("state", ask)
        self._is_made = ask("readings-made")
        self.readings: Any = None
        if ask("given-as-moment"):
            snapshot = Snapshot(ColumnNames(["s"]), (self._state,), _NOW)
            self.readings = snapshot if self._is_made else object.__new__(Snapshot)
        elif self._is_made:
            self.readings = {"s": Reading(self._state, _NOW)}

    def individual_readings(self, readings: Any) -> None:
        """Check the readings given to the slow path: raises unless they are these, one by one."""
        ((name, (value, time)),) = readings.items()
        if type(readings) is not dict or name != "s" or value is not self._state or time is not _NOW:
            raise ValueError(readings)


_NOW: Final = 0.0


# `_Decider._objections`: every layer, and what the proof stands in for.

OBJECTIONS: Final = "(declare-datatypes ((Objections 0)) (((none) (only-a) (only-b) (only-ab) (others))))"
"""Sort of the objections to an action: none, rules of Φ alone, or any other."""

_CLASSES: Final[Mapping[tuple[str, ...], str]] = {
    (): "none",
    ("rule.a",): "only-a",
    ("rule.b",): "only-b",
    RULES: "only-ab",
}


def objection_class(reasons: Sequence[Reason]) -> str:
    """Classify objections as a term of sort Objections."""
    if any(reason.code != "AE750" for reason in reasons):
        return "others"
    return _CLASSES[tuple(dict.fromkeys(reason.rule for reason in reasons))]


@cache
def execute_objections(
    code: ModuleSource,
    variant: GateVariant = ANY_CONFIGURATION,
    reasons_term: Callable[[Sequence[Reason]], str] = objection_class,
) -> DecisionDiagram:
    """Execute `_objections` on the action `asked`; `reasons_term` makes a term of sort Objections."""
    gate = code.module(GATE)

    def run(ask: DecideBranch) -> str:
        def unpack_arguments(
            forms: Mapping[str, Any], given: Mapping[str, Any], whose: str, into: dict[str, Any]
        ) -> Iterator[Reason]:
            (name,) = forms
            formed = {"inputs.i": "inputs-formed", "p": f"(parameters-formed {REQUESTED_ACTION})"}[name]
            if ask(formed):
                into[name] = given[name]
            else:
                yield Reason("AE704", name, whose)

        def unpack_readings(
            forms: Mapping[str, Any],
            readings: Any,
            now: Any,
            required: Any,
            into: dict[str, Any],
            *,
            module_variables: frozenset[str],
        ) -> Iterator[Reason]:
            (name,) = forms
            if ask("readings-serve"):
                into[name] = readings[name]
            else:
                yield Reason("AE704", name, "")

        decider = _decider(
            gate, ask, variant, unpack_arguments=unpack_arguments, unpack_readings=unpack_readings
        )
        return reasons_term(decider._objections(*_symbolic_request(ask), 0.0, {}, {}))

    return execute_symbolically(run)


# `_Decider._compile`: what the short way is given to decide by.

CRITERIA: Final = (
    "(declare-datatypes ((Criteria 0)) (((criteria (allows Bool) (left Bool)) (no-short-way))))",
    "(declare-const static-layers-pass Bool)",
)
"""Declarations of the fast path's criteria: may it allow, and do its residual conditions hold."""


@cache
def execute_criteria(code: ModuleSource, variant: GateVariant = ANY_CONFIGURATION) -> DecisionDiagram:
    """Execute `_compile` for the criteria of the fast path: a term of sort Criteria."""
    gate = code.module(GATE)

    def run(ask: DecideBranch) -> str:
        def finite_objections(_: Any, __: Any, ___: Any, usage: Mapping[str, int]) -> Iterator[Reason]:
            if not ask("static-layers-pass"):
                yield Reason("AE710", "block", "")
            if usage["q"] >= _QUOTA.max_count:
                yield Reason("AE742", "q", "")

        decider = _decider(gate, ask, variant, (_QUOTA,), finite_objections=finite_objections)
        if ("m", "k", "a") not in decider._fast_paths:
            return "no-short-way"
        criteria = decider._fast_paths.compile(("m", "k", "a"))
        return smt_apply(
            "criteria", smt_literal(criteria.can_allow), smt_literal(condition_holds(ask, criteria.residual))
        )

    return execute_symbolically(run)


_QUOTA: Final = SimpleNamespace(id="q", max_count=5)


def _values(ask: DecideBranch) -> dict[str, SymbolicValue]:
    return {
        "inputs.i": SymbolicValue("input", ask),
        "s": SymbolicValue("state", ask),
        "p": SymbolicValue(REQUESTED_ACTION, ask),
    }


# `_Decider.decide`: what is forwarded.

DECISION: Final = (
    "(declare-datatypes ((Decision 0))"
    " (((allow (allowed Value)) (attenuate (reduced Value)) (deny) (wrong))))",
    "(declare-datatypes ((ShortWay 0)) (((short-allows) (short-denies) (short-leaves) (short-silent))))",
    "(declare-fun objections (Value) Objections)",
    "(declare-fun unmet (Value) Objections)",
    "(declare-fun short-way (Value) ShortWay)",
    "(declare-const given-as-moment Bool)",
)
"""Sort of decisions, and their inputs: objections and fast path; `wrong` is a result that is no decision."""


def assume_no_objection(holds: Callable[[str], str]) -> dict[str, str]:
    """Assume that this `holds` of every action without objections.

    The short way speaks for the action asked for, and of a request that is one.
    """
    return {
        **{
            f"objections.{place}": smt_implies(f"(= (objections {one}) none)", holds(one))
            for place, one in enumerate(FORWARDABLE_ACTIONS)
        },
        "short-way-allows": smt_implies("(= (short-way asked) short-allows)", holds(REQUESTED_ACTION)),
        "short-way-speaks": FAST_PATH_ANSWERS,
    }


FAST_PATH_ANSWERS: Final = "(or (= (short-way asked) short-silent) (and request-formed time-formed))"


def _attenuated_stub(rules: Any, _: str, asked: Mapping[str, Any], __: Any) -> dict[str, Any]:
    """Stands for `attenuated`."""
    less = _ATTENUATED_TERMS[tuple(rule.id for rule in rules)]
    return {"p": SymbolicValue(smt_apply(less, "state", asked["p"].term), asked["p"].ask)}


@cache
def execute_decision(code: ModuleSource, action_term: str = REQUESTED_ACTION) -> DecisionDiagram:
    """Execute `decide` on the action `action_term`: a term of sort Decision."""
    gate = code.module(GATE)

    def run(ask: DecideBranch) -> str:
        caller, _, action = _symbolic_request(ask, action_term)
        given = _GivenReadings(ask)
        short = smt_apply("short-way", action_term)

        def objecting(function: str, asked: Action) -> list[Reason]:
            term = smt_apply(function, asked.parameters["p"].term)
            for rules, found in _CLASSES.items():
                if ask(f"(= {term} {found})"):
                    return [Reason("AE750", rule, "") for rule in rules]
            return [Reason("AE730", "a", "")]

        def decide_fast(*_: Any) -> Decision | dict[str, Any] | None:
            if ask(f"(= {short} short-allows)"):
                return Decision(DecisionKind.ALLOW, action, ())
            if ask(f"(= {short} short-denies)"):
                return Decision(DecisionKind.DENY, None, (Reason("AE750", "rule.a", ""),))
            return {} if ask(f"(= {short} short-leaves)") else None

        def unless(question: str) -> Callable[..., Reason | None]:
            return lambda *_: None if ask(question) else Reason("AE701", "request", "")

        def request_fault(_: Any, readings: Any, *__: Any) -> Reason | None:
            # It takes a dictionary and nothing else.
            return unless("rest-formed" if type(readings) is dict else "false")()

        def objections(_: Any, readings: Any, asked: Action, *__: Any) -> list[Reason]:
            given.individual_readings(readings)
            return objecting("objections", asked)

        decider = _decider(
            gate,
            ask,
            decide_fast=decide_fast,
            attenuate_parameters=_attenuated_stub,
            request_fault=request_fault,
            check_time=unless("time-formed"),
        )
        # The methods below are explored by themselves.
        decider._objections = objections
        decider._violated_conditions = lambda _, asked, __: objecting("unmet", asked)
        return _decision_term(decider.decide(caller, given.readings, action, _NOW, {}))

    return execute_symbolically(run, raising="wrong")


# `_Decider.decide` of what the configuration does not know.

UNKNOWN_NAME_DECLARATIONS: Final = tuple(
    f"(declare-const {name} Bool)" for name in ("module-active", "skill-exists", "kind-known", "in-envelope")
)
"""Facts about the names in a request, any of which may not exist."""


def execute_unknown_request(code: ModuleSource) -> DecisionDiagram:
    """Execute `decide` for any caller and any kind of action: a term of sort Decision."""
    gate = code.module(GATE)

    def run(ask: DecideBranch) -> str:
        known = {name: ask(name) for name in ("module-active", "skill-exists", "kind-known", "in-envelope")}
        caller, readings, action = _symbolic_request(ask)

        def finite_objections(*_: Any) -> Iterator[Reason]:
            if not (known["module-active"] and known["skill-exists"] and known["kind-known"]):
                yield Reason("AE720", "stranger", "")

        install_stubs(gate, {"finite_objections": finite_objections, **_gate_stubs(ask)})

        def take(_: Any, given: Mapping[str, Any], *more: Any, **__: Any) -> Iterator[Reason]:
            more[-1].update(given)
            return iter(())

        unpackers = {
            "unpack_arguments": take,
            "unpack_readings": take,
            "attenuate_parameters": _attenuated_stub,
        }
        silent = {name: lambda *_: None for name in ("request_fault", "check_time", "decide_fast")}
        install_stubs(gate, {**unpackers, **silent})
        configuration = _configuration(ask, ANY_CONFIGURATION, ())
        module = configuration.modules["m"]
        if not known["kind-known"]:
            configuration.site.kinds = {}
        if not (known["in-envelope"] and known["kind-known"]):
            module.skills["k"].envelope = {}
        if not known["skill-exists"]:
            module.skills = {}
        if not known["module-active"]:
            configuration.modules = {}
        decider = gate._Decider(configuration, True)
        return _decision_term(decider.decide(caller, readings, action, 0.0, {}))

    return execute_symbolically(run, raising="wrong")


def _decision_term(decision: Decision) -> str:
    match decision:
        case Decision(DecisionKind.ALLOW, Action("a", {"p": SymbolicValue(term=term)}), ()):
            return smt_apply("allow", term)
        case Decision(DecisionKind.ATTENUATE, Action("a", {"p": SymbolicValue(term=term)}), reasons) if (
            reasons
        ):
            return smt_apply("attenuate", term)
        case Decision(DecisionKind.DENY, None, reasons):
            return "deny"
        case _:
            return "wrong"
