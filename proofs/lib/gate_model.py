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

from aeros.runtime.gate.conditions import Truth
from aeros.runtime.gate.decision import Caller, Decision, Reason, Verdict
from aeros.runtime.ports import Moment, Names, Reading
from aeros.skill import Action
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL
from aeros.spec.obligations.claim_id import ClaimForm, ClaimId
from aeros.spec.theorems.module_copies import Code, put_in_place
from aeros.spec.theorems.smtlib import application, conjunction, implication, literal
from aeros.spec.theorems.symbolic_execution import Ask, Diagram, Symbol, explore

GATE: Final = "aeros.runtime.gate.gate"

RULES: Final = ("rule.a", "rule.b")

ASKED: Final = "asked"


@dataclass(frozen=True)
class Variant:
    """The configuration that a gate is made for, where that is not arbitrary.

    rules: what Φ says of the kind.
    compiled: whether the gate is compiled; None for either.
    certified: whether there is a certificate that may call something proved; what it calls so has
        names that begin with `under`.
    modules: those that are active, in their order; `m` is the one that asks.
    """

    rules: tuple[str, ...] = RULES
    compiled: bool | None = None
    certified: bool = True
    under: str = ""
    modules: tuple[str, ...] = ("m",)


ANY: Final = Variant()

_LESS: Final = {("rule.a",): "less.a", ("rule.b",): "less.b", RULES: "less.ab"}
"""What reduces an action, by the rules that stand in its way."""

REDUCED: Final = tuple(f"({less} state asked)" for less in _LESS.values())
"""Every action other than the one asked for that could be forwarded."""

CANDIDATES: Final = (ASKED, *REDUCED)

_READS: Final[Mapping[str, tuple[str, ...]]] = {
    "envelope": ("inputs.i", "s", "p"),
    "permission": ("inputs.i", "s", "p"),
    **dict.fromkeys(RULES, ("s", "p")),
    "other.envelope": ("inputs.i", "s", "p"),
    "other.permission": ("inputs.i", "s", "p"),
}
"""The scalar variables that each condition is about: input, state and parameters."""

_EVERYTHING: Final = "residue"

DECLARATIONS: Final = (
    "(declare-sort Value 0)",
    "(declare-const state Value)",
    "(declare-const input Value)",
    "(declare-const asked Value)",
    *(f"(declare-fun {name} ({' '.join(['Value'] * len(read))}) Bool)" for name, read in _READS.items()),
    *(f"(declare-fun {less} (Value Value) Value)" for less in _LESS.values()),
    *(f"(declare-const {whose}permission-declared Bool)" for whose in ("", "other.")),
    "(declare-const compiled Bool)",
    *(
        f"(declare-const {under}proved.{name} Bool)"
        for under in ("", "fewer.", "other.")
        for name in ("permission", *RULES)
    ),
    *(f"(declare-fun gives-up.{name} (Value) Bool)" for name in (*_READS, _EVERYTHING)),
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
"""What every formula about the gate may speak of."""


PASSES: Final = (
    "(define-fun well-formed ((x Value)) Bool (and (parameters-formed x) inputs-formed readings-serve))",
    "(define-fun inside ((x Value)) Bool (envelope input state x))",
    "(define-fun permitted ((x Value)) Bool (and permission-declared (permission input state x)))",
    "(define-fun obeys-a ((x Value)) Bool (rule.a state x))",
    "(define-fun obeys-b ((x Value)) Bool (rule.b state x))",
    "(define-fun passes ((x Value)) Bool (and (well-formed x) finite-layers-pass (inside x) (permitted x)"
    " (obeys-a x) (obeys-b x)))",
    "(define-fun sound ((x Value)) Bool (and request-formed time-formed (passes x)))",
)
"""What the layers are there for.

A module that declares no permission for a kind has none.  `passes`: no layer objects to an action;
`sound`: what must be true of every action that is forwarded.
"""


def residue(action: str, under: str = "") -> dict[str, str]:
    """What install-time proofs say of `action`: what the certificate claims, holds inside the envelope.

    As assumptions, by name.  A proof is about values of their declared forms.
    """
    claims = {"permission": "permitted", "rule.a": "obeys-a", "rule.b": "obeys-b"}
    return {
        f"{under}proof-of.{name}": f"(=> (and {under}proved.{name} (well-formed {action}) (inside {action}))"
        f" ({claim} {action}))"
        for name, claim in claims.items()
    }


SOLVER_DECIDES: Final = implication(
    "(not compiled)", conjunction(f"(not (gives-up.{name} asked))" for name in (*_READS, _EVERYTHING))
)
"""A gate that asks Z3 each time gets an answer about the action asked for."""


class _Condition:
    """Any condition as a gate has it compiled: a conjunction of what is uninterpreted.

    certain: compiled; a solver may give up, of which the gate must make a denial.
    """

    def __init__(self, ask: Ask, term: t.Term, *, certain: bool) -> None:
        self._ask, self._certain = ask, certain
        self._parts = term.operands if isinstance(term, t.And) else (term,)
        self.names = frozenset(name for read in t.variables_of(term) for name in _READS[read])

    def decide(self, values: Mapping[str, Any]) -> Truth:
        """As `Condition.decide`."""
        if not self._certain and self.names and self._ask(self._gives_up(values)):
            return Truth.UNDECIDED
        return Truth.HOLDS if all(self._holds(part, values) for part in self._parts) else Truth.FAILS

    def _gives_up(self, values: Mapping[str, Any]) -> str:
        names = [part.name for part in self._parts if isinstance(part, t.Variable)]
        which = names[0] if len(names) == 1 else _EVERYTHING
        return application(f"gives-up.{which}", values["p"].term)

    def _holds(self, part: t.Term, values: Mapping[str, Any]) -> bool:
        if isinstance(part, t.Literal):
            return bool(part.value)
        if not isinstance(part, t.Variable):
            raise InternalError(f"the gate made a condition that nothing here speaks of: {part}")
        return self._ask(application(part.name, *(values[name].term for name in _READS[part.name])))


class _Proved:
    """The obligations that a certificate says are proved."""

    _CLAIMS: Final = {ClaimForm.ENVELOPE_OBEYS("k", "a", rule): rule for rule in RULES} | {
        ClaimForm.ENVELOPE_PERMITTED("k", "a"): "permission"
    }

    def __init__(self, ask: Ask, under: str) -> None:
        self._ask, self._under = ask, under

    def __contains__(self, obligation: ClaimId) -> bool:
        return self._ask(f"{self._under}proved.{self._CLAIMS[obligation]}")


class _Permission:
    """What a module may ask for, by action kind; it may say nothing of the kind."""

    def __init__(self, ask: Ask, whose: str) -> None:
        self._ask, self._whose = ask, whose

    def __contains__(self, _: str) -> bool:
        return self._ask(f"{self._whose}permission-declared")

    def __getitem__(self, _: str) -> Any:
        return SimpleNamespace(term=variable(f"{self._whose}permission"))


class _Attenuations:
    """Whether a rule says how an action that breaks it is reduced; how it does, `attenuated` knows."""

    def __init__(self, ask: Ask, rule: str) -> None:
        self._ask, self._rule = ask, rule

    def __contains__(self, _: str) -> bool:
        return self._ask(f"attenuates.{self._rule}")

    def get(self, _: str, default: Mapping[str, t.Term]) -> Mapping[str, t.Term]:
        """Nothing: which state it reads is of no account, as there is one state variable."""
        return default


def holds(ask: Ask, term: t.Term) -> bool:
    """Whether a condition that code has made of uninterpreted ones holds of the action asked for."""
    return _Condition(ask, term, certain=True).decide(_values(ask)) is Truth.HOLDS


def variable(name: str) -> t.Variable:
    """The uninterpreted condition of that name, as a term."""
    return t.Variable(name, BOOL, t.Role.PARAMETER)


def _configuration(ask: Ask, variant: Variant, quotas: tuple[Any, ...]) -> Any:
    """A configuration of active modules, each of whose skill `k` may ask for actions of the kind `a`."""
    rules = tuple(
        SimpleNamespace(
            id=rule,
            text=rule,
            rationale=rule,
            terms={"a": variable(rule)},
            attenuations=_Attenuations(ask, rule),
        )
        for rule in variant.rules
    )
    site = SimpleNamespace(
        observed={"s": SimpleNamespace(name="s")},
        kinds={"a": SimpleNamespace(name="a", parameters={"p": SimpleNamespace(name="p")})},
        rules_on=lambda _: rules,
        quotas=quotas,
    )
    modules: dict[str, Any] = {}
    for module in variant.modules:
        whose = "" if module == "m" else "other."
        skill = SimpleNamespace(
            id="k",
            inputs={"i": SimpleNamespace(name="inputs.i")},
            envelope={"a": SimpleNamespace(term=variable(f"{whose}envelope"))},
        )
        modules[module] = SimpleNamespace(id=module, skills={"k": skill}, permission=_Permission(ask, whose))

    def proved(module: str) -> Any:
        under = variant.under if module == "m" else "other."
        return _Proved(ask, under) if variant.certified else frozenset()

    return SimpleNamespace(site=site, modules=modules, proved=proved)


def _decider(
    gate: ModuleType, ask: Ask, variant: Variant = ANY, quotas: tuple[Any, ...] = (), **stubs: Any
) -> Any:
    """The decider of the configuration, by this copy of the gate with what it calls put aside."""

    def finite_objections(*_: Any) -> Iterator[Reason]:
        if not ask("finite-layers-pass"):
            yield Reason("AE710", "block", "")

    put_in_place(gate, {**_putting_aside(ask), "finite_objections": finite_objections, **stubs})
    compiled = ask("compiled") if variant.compiled is None else variant.compiled
    return gate._Decider(_configuration(ask, variant, quotas), compiled)


def _putting_aside(ask: Ask) -> dict[str, Any]:
    """What stands for all that compiles conditions and forms."""
    return {
        "CompiledCondition": lambda term, _: _Condition(ask, term, certain=True),
        "SolverCondition": lambda term, *_: _Condition(ask, term, certain=False),
        "JointRules": lambda *_, **__: None,
        "compile_truths": lambda terms, _: tuple(terms),
        "compile_one_by_one": lambda *_: None,
        "compile_straight": lambda criteria, **_: criteria,
        "MomentTaker": lambda _: None,
        "forms_of": lambda declared: {one.name: one.name for one in declared.values()},
        "ranges_of": lambda _: {},
    }


def _request(ask: Ask, about: str = ASKED) -> tuple[Caller, dict[str, Any], Action]:
    """What is decided: who asks, what is measured, and for what."""
    caller = Caller("m", "k", {"i": Symbol("input", ask)})
    return caller, {"s": Symbol("state", ask)}, Action("a", {"p": Symbol(about, ask)})


class _Given:
    """Readings in either way in which they can be given, and what they are one by one."""

    def __init__(self, ask: Ask) -> None:
        self._state = Symbol("state", ask)
        self._is_made = ask("readings-made")
        self.readings: Any = None
        if ask("given-as-moment"):
            moment = Moment(Names(["s"]), (self._state,), _NOW)
            self.readings = moment if self._is_made else object.__new__(Moment)
        elif self._is_made:
            self.readings = {"s": Reading(self._state, _NOW)}

    def look(self, readings: Any) -> None:
        """What the long way is given: raises where it is not these readings, one by one."""
        ((name, (value, time)),) = readings.items()
        if type(readings) is not dict or name != "s" or value is not self._state or time is not _NOW:
            raise ValueError(readings)


_NOW: Final = 0.0


# `_Decider._objections`: every layer, and what the proof stands in for.

OBJECTIONS: Final = "(declare-datatypes ((Objections 0)) (((none) (only-a) (only-b) (only-ab) (others))))"
"""What objects to an action: nothing, rules of Φ alone, or anything else."""

_CLASSES: Final[Mapping[tuple[str, ...], str]] = {
    (): "none",
    ("rule.a",): "only-a",
    ("rule.b",): "only-b",
    RULES: "only-ab",
}


def class_of(found: Sequence[Reason]) -> str:
    """Which class of objections these are."""
    if any(reason.code != "AE750" for reason in found):
        return "others"
    return _CLASSES[tuple(dict.fromkeys(reason.rule for reason in found))]


@cache
def explore_objections(
    code: Code, variant: Variant = ANY, told: Callable[[Sequence[Reason]], str] = class_of
) -> Diagram:
    """What `_objections` finds against the action `asked`: as `told`, a term of sort Objections."""
    gate = code.module(GATE)

    def run(ask: Ask) -> str:
        def take_given(
            forms: Mapping[str, Any], given: Mapping[str, Any], whose: str, into: dict[str, Any]
        ) -> Iterator[Reason]:
            (name,) = forms
            formed = {"inputs.i": "inputs-formed", "p": f"(parameters-formed {ASKED})"}[name]
            if ask(formed):
                into[name] = given[name]
            else:
                yield Reason("AE704", name, whose)

        def take_readings(
            forms: Mapping[str, Any], readings: Any, now: Any, required: Any, into: dict[str, Any]
        ) -> Iterator[Reason]:
            (name,) = forms
            if ask("readings-serve"):
                into[name] = readings[name]
            else:
                yield Reason("AE704", name, "")

        decider = _decider(gate, ask, variant, take_given=take_given, take_readings=take_readings)
        return told(decider._objections(*_request(ask), 0.0, {}, {}))

    return explore(run)


# `_Decider._compile`: what the short way is given to decide by.

CRITERIA: Final = (
    "(declare-datatypes ((Criteria 0)) (((criteria (allows Bool) (left Bool)) (no-short-way))))",
    "(declare-const static-layers-pass Bool)",
)
"""Whether it may allow at all, and whether what it evaluates beside the envelope holds of `asked`."""


@cache
def explore_criteria(code: Code, variant: Variant = ANY) -> Diagram:
    """What `_compile` gives the short way: a term of sort Criteria."""
    gate = code.module(GATE)

    def run(ask: Ask) -> str:
        def finite_objections(_: Any, __: Any, ___: Any, usage: Mapping[str, int]) -> Iterator[Reason]:
            if not ask("static-layers-pass"):
                yield Reason("AE710", "block", "")
            if usage["q"] >= _QUOTA.at_most:
                yield Reason("AE742", "q", "")

        decider = _decider(gate, ask, variant, (_QUOTA,), finite_objections=finite_objections)
        criteria = decider._straight.get(("m", "k", "a"))
        if criteria is None:
            return "no-short-way"
        return application("criteria", literal(criteria.allows), literal(holds(ask, criteria.left)))

    return explore(run)


_QUOTA: Final = SimpleNamespace(id="q", at_most=5)


def _values(ask: Ask) -> dict[str, Symbol]:
    return {"inputs.i": Symbol("input", ask), "s": Symbol("state", ask), "p": Symbol(ASKED, ask)}


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
"""What is decided, by what objects and what the short way says; `wrong` is anything that is no decision."""


def where_nothing_objects(holds: Callable[[str], str]) -> dict[str, str]:
    """What is assumed of an action to which nothing objects: that this `holds` of it, whichever it is.

    The short way speaks for the action asked for, and of a request that is one.
    """
    return {
        **{
            f"objections.{place}": implication(f"(= (objections {one}) none)", holds(one))
            for place, one in enumerate(CANDIDATES)
        },
        "short-way-allows": implication("(= (short-way asked) short-allows)", holds(ASKED)),
        "short-way-speaks": SHORT_WAY_SPEAKS,
    }


SHORT_WAY_SPEAKS: Final = "(or (= (short-way asked) short-silent) (and request-formed time-formed))"


def _less(rules: Any, _: str, asked: Mapping[str, Any], __: Any) -> dict[str, Any]:
    """Stands for `attenuated`."""
    less = _LESS[tuple(rule.id for rule in rules)]
    return {"p": Symbol(application(less, "state", asked["p"].term), asked["p"].ask)}


@cache
def explore_decision(code: Code, about: str = ASKED) -> Diagram:
    """What `decide` does about the action `about`: a term of sort Decision."""
    gate = code.module(GATE)

    def run(ask: Ask) -> str:
        caller, _, action = _request(ask, about)
        given = _Given(ask)
        short = application("short-way", about)

        def objecting(function: str, asked: Action) -> list[Reason]:
            term = application(function, asked.parameters["p"].term)
            for rules, found in _CLASSES.items():
                if ask(f"(= {term} {found})"):
                    return [Reason("AE750", rule, "") for rule in rules]
            return [Reason("AE730", "a", "")]

        def decide_straight(*_: Any) -> Decision | dict[str, Any] | None:
            if ask(f"(= {short} short-allows)"):
                return Decision(Verdict.ALLOW, action, ())
            if ask(f"(= {short} short-denies)"):
                return Decision(Verdict.DENY, None, (Reason("AE750", "rule.a", ""),))
            return {} if ask(f"(= {short} short-leaves)") else None

        def unless(question: str) -> Callable[..., Reason | None]:
            return lambda *_: None if ask(question) else Reason("AE701", "request", "")

        def request_fault(_: Any, readings: Any, *__: Any) -> Reason | None:
            # It takes a dictionary and nothing else.
            return unless("rest-formed" if type(readings) is dict else "false")()

        def objections(_: Any, readings: Any, asked: Action, *__: Any) -> list[Reason]:
            given.look(readings)
            return objecting("objections", asked)

        decider = _decider(
            gate,
            ask,
            decide_straight=decide_straight,
            attenuated=_less,
            request_fault=request_fault,
            check_now=unless("time-formed"),
        )
        # The methods below are explored by themselves.
        decider._objections = objections
        decider._unmet = lambda _, asked, __: objecting("unmet", asked)
        return _decided(decider.decide(caller, given.readings, action, _NOW, {}))

    return explore(run, raising="wrong")


# `_Decider.decide` of what the configuration does not know.

STRANGERS: Final = tuple(
    f"(declare-const {name} Bool)" for name in ("module-active", "skill-exists", "kind-known", "in-envelope")
)
"""What a caller names that there may not be."""


def explore_strangers(code: Code) -> Diagram:
    """What `decide` does, whoever asks for whatever kind of action: a term of sort Decision."""
    gate = code.module(GATE)

    def run(ask: Ask) -> str:
        known = {name: ask(name) for name in ("module-active", "skill-exists", "kind-known", "in-envelope")}
        caller, readings, action = _request(ask)

        def finite_objections(*_: Any) -> Iterator[Reason]:
            if not (known["module-active"] and known["skill-exists"] and known["kind-known"]):
                yield Reason("AE720", "stranger", "")

        put_in_place(gate, {"finite_objections": finite_objections, **_putting_aside(ask)})

        def take(_: Any, given: Mapping[str, Any], *more: Any) -> Iterator[Reason]:
            more[-1].update(given)
            return iter(())

        taking = {"take_given": take, "take_readings": take, "attenuated": _less}
        silent = {name: lambda *_: None for name in ("request_fault", "check_now", "decide_straight")}
        put_in_place(gate, {**taking, **silent})
        configuration = _configuration(ask, ANY, ())
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
        return _decided(decider.decide(caller, readings, action, 0.0, {}))

    return explore(run, raising="wrong")


def _decided(decision: Decision) -> str:
    match decision:
        case Decision(Verdict.ALLOW, Action("a", {"p": Symbol(term=term)}), ()):
            return application("allow", term)
        case Decision(Verdict.ATTENUATE, Action("a", {"p": Symbol(term=term)}), reasons) if reasons:
            return application("attenuate", term)
        case Decision(Verdict.DENY, None, reasons):
            return "deny"
        case _:
            return "wrong"
