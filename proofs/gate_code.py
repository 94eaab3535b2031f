"""The gate as it ships, explored: what its code decides, with the policy and all values uninterpreted.

Each part of `aeros/runtime/gate.py` is run with what it calls put aside, and what it calls is explored
by itself.  Formulas of one part speak of the others by the same names, so that together they are the gate:

- `state`, `input`, `asked`: what is measured, what the skill was started with, what it asks for.
- `envelope`, `permission`, `rule.a`, `rule.b`: arbitrary conditions on these; two rules stand for any
  number, as the code treats each by itself.
- `proved.X`: the certificate says that condition X is proved of everything in the envelope.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from types import ModuleType, SimpleNamespace
from typing import Any, Final

from aeros.runtime.conditions import Truth
from aeros.runtime.decision import Caller, Decision, Reason, Verdict
from aeros.skill import Action
from aeros.spec.errors import InternalError
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL
from aeros.spec.theorems.exploring import Ask, Diagram, Symbol, explore
from aeros.spec.theorems.formulas import application, literal
from aeros.spec.theorems.shipped import Code, put_in_place

GATE: Final = "aeros.runtime.gate"

RULES: Final = ("rule.a", "rule.b")

ASKED: Final = "asked"

_LESS: Final = {("rule.a",): "less.a", ("rule.b",): "less.b", RULES: "less.ab"}
"""What reduces an action, by the rules that stand in its way."""

REDUCED: Final = tuple(f"({less} state asked)" for less in _LESS.values())
"""Every action other than the one asked for that could be forwarded."""

_READS: Final[Mapping[str, tuple[str, ...]]] = {
    "envelope": ("inputs.i", "s", "p"),
    "permission": ("inputs.i", "s", "p"),
    **dict.fromkeys(RULES, ("s", "p")),
}
"""The scalar variables that each condition is about: input, state and parameters."""

_EVERYTHING: Final = "-".join(_READS)

DECLARATIONS: Final = (
    "(declare-sort Value 0)",
    "(declare-const state Value)",
    "(declare-const input Value)",
    "(declare-const asked Value)",
    *(f"(declare-fun {name} ({' '.join(['Value'] * len(read))}) Bool)" for name, read in _READS.items()),
    *(f"(declare-fun {less} (Value Value) Value)" for less in _LESS.values()),
    "(declare-const permission-declared Bool)",
    "(declare-const compiled Bool)",
    *(f"(declare-const proved.{name} Bool)" for name in ("permission", *RULES)),
    *(f"(declare-fun gives-up.{name} (Value) Bool)" for name in (*_READS, _EVERYTHING)),
    *(f"(declare-const attenuates.{rule} Bool)" for rule in RULES),
    "(declare-const request-formed Bool)",
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


def residue(action: str) -> dict[str, str]:
    """What install-time proofs say of `action`: what the certificate claims, holds inside the envelope.

    As assumptions, by name.  A proof is about values of their declared forms.
    """
    claims = {"permission": "permitted", "rule.a": "obeys-a", "rule.b": "obeys-b"}
    return {
        f"proof-of.{name}": f"(=> (and proved.{name} (well-formed {action}) (inside {action}))"
        f" ({claim} {action}))"
        for name, claim in claims.items()
    }


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

    _CLAIMS: Final = {f"safety/k/a/{rule}": rule for rule in RULES} | {"permission/k/a": "permission"}

    def __init__(self, ask: Ask) -> None:
        self._ask = ask

    def __contains__(self, obligation: str) -> bool:
        return self._ask(f"proved.{self._CLAIMS[obligation]}")


class _Permission:
    """What a module may ask for, by action kind; it may say nothing of the kind."""

    def __init__(self, ask: Ask) -> None:
        self._ask = ask

    def __contains__(self, _: str) -> bool:
        return self._ask("permission-declared")

    def __getitem__(self, _: str) -> Any:
        return SimpleNamespace(term=_variable("permission"))


class _Attenuations:
    """Whether a rule says how an action that breaks it is reduced; how it does, `attenuated` knows."""

    def __init__(self, ask: Ask, rule: str) -> None:
        self._ask, self._rule = ask, rule

    def __contains__(self, _: str) -> bool:
        return self._ask(f"attenuates.{self._rule}")

    def get(self, _: str, default: Mapping[str, t.Term]) -> Mapping[str, t.Term]:
        """Nothing: which state it reads is of no account, as there is one state variable."""
        return default


def _variable(name: str) -> t.Variable:
    return t.Variable(name, BOOL, t.Role.PARAMETER)


def _configuration(ask: Ask, quotas: tuple[Any, ...]) -> Any:
    """A configuration of one active module `m`, whose skill `k` may ask for actions of the kind `a`."""
    rules = tuple(
        SimpleNamespace(
            id=rule,
            text=rule,
            rationale=rule,
            terms={"a": _variable(rule)},
            attenuations=_Attenuations(ask, rule),
        )
        for rule in RULES
    )
    site = SimpleNamespace(
        observed={"s": SimpleNamespace(name="s")},
        kinds={"a": SimpleNamespace(name="a", parameters={"p": SimpleNamespace(name="p")})},
        rules_on=lambda _: rules,
        quotas=quotas,
    )
    skill = SimpleNamespace(
        id="k",
        inputs={"i": SimpleNamespace(name="inputs.i")},
        envelope={"a": SimpleNamespace(term=_variable("envelope"))},
    )
    ecm = SimpleNamespace(id="m", skills={"k": skill}, permission=_Permission(ask))
    return SimpleNamespace(site=site, modules={"m": ecm}, proved=lambda _: _Proved(ask))


def _decider(gate: ModuleType, ask: Ask, compiled: bool, quotas: tuple[Any, ...] = (), **stubs: Any) -> Any:
    """The decider of the configuration, by this copy of the gate with what it calls put aside."""

    def finite_objections(*_: Any) -> Iterator[Reason]:
        if not ask("finite-layers-pass"):
            yield Reason("AE710", "block", "")

    put_in_place(
        gate,
        {
            "CompiledCondition": lambda term, _: _Condition(ask, term, certain=True),
            "SolverCondition": lambda term, *_: _Condition(ask, term, certain=False),
            "JointRules": lambda *_, **__: None,
            "compile_truths": lambda terms, _: tuple(terms),
            "compile_straight": lambda criteria, **_: criteria,
            "forms_of": lambda declared: {one.name: one.name for one in declared.values()},
            "ranges_of": lambda _: {},
            "finite_objections": finite_objections,
            **stubs,
        },
    )
    return gate._Decider(_configuration(ask, quotas), compiled)


def _request(ask: Ask) -> tuple[Caller, dict[str, Any], Action]:
    """What is decided: who asks, what is measured, and for what."""
    caller = Caller("m", "k", {"i": Symbol("input", ask)})
    return caller, {"s": Symbol("state", ask)}, Action("a", {"p": Symbol(ASKED, ask)})


# `_Decider._objections`: every layer, and what the proof stands in for.

OBJECTIONS: Final = "(declare-datatypes ((Objections 0)) (((none) (only-a) (only-b) (only-ab) (others))))"
"""What objects to an action: nothing, rules of Φ alone, or anything else."""

_CLASSES: Final[Mapping[tuple[str, ...], str]] = {
    (): "none",
    ("rule.a",): "only-a",
    ("rule.b",): "only-b",
    RULES: "only-ab",
}


def explore_objections(code: Code) -> Diagram:
    """What `_objections` finds against the action `asked`: a term of sort Objections."""
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

        decider = _decider(gate, ask, ask("compiled"), take_given=take_given, take_readings=take_readings)
        found = decider._objections(*_request(ask), 0.0, {}, {})
        if any(reason.code != "AE750" for reason in found):
            return "others"
        return _CLASSES[tuple(dict.fromkeys(reason.rule for reason in found))]

    return explore(run)


# `_Decider._compile`: what the short way is given to decide by.

CRITERIA: Final = (
    "(declare-datatypes ((Criteria 0)) (((criteria (allows Bool) (left Bool)) (no-short-way))))",
    "(declare-const static-layers-pass Bool)",
)
"""Whether it may allow at all, and whether what it evaluates beside the envelope holds of `asked`."""


def explore_criteria(code: Code) -> Diagram:
    """What `_compile` gives the short way: a term of sort Criteria."""
    gate = code.module(GATE)

    def run(ask: Ask) -> str:
        def finite_objections(_: Any, __: Any, ___: Any, usage: Mapping[str, int]) -> Iterator[Reason]:
            if not ask("static-layers-pass"):
                yield Reason("AE710", "block", "")
            if usage["q"] >= _QUOTA.at_most:
                yield Reason("AE742", "q", "")

        decider = _decider(gate, ask, ask("compiled"), (_QUOTA,), finite_objections=finite_objections)
        if not decider._straight:
            return "no-short-way"
        ((at, criteria),) = decider._straight.items()
        if at != ("m", "k", "a"):
            return "no-short-way"
        left = _Condition(ask, criteria.left, certain=True).decide(_values(ask)) is Truth.HOLDS
        return application("criteria", literal(criteria.allows), literal(left))

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
    "(declare-const short-way ShortWay)",
)
"""What is decided, by what objects and what the short way says; `wrong` is anything that is no decision."""


def explore_decision(code: Code) -> Diagram:
    """What `decide` does about the action `asked`: a term of sort Decision."""
    gate = code.module(GATE)

    def run(ask: Ask) -> str:
        caller, readings, action = _request(ask)

        def objecting(function: str, asked: Action) -> list[Reason]:
            term = application(function, asked.parameters["p"].term)
            for rules, found in _CLASSES.items():
                if ask(f"(= {term} {found})"):
                    return [Reason("AE750", rule, "") for rule in rules]
            return [Reason("AE730", "a", "")]

        def decide_straight(*_: Any) -> Decision | dict[str, Any] | None:
            if ask("(= short-way short-allows)"):
                return Decision(Verdict.ALLOW, action, ())
            if ask("(= short-way short-denies)"):
                return Decision(Verdict.DENY, None, (Reason("AE750", "rule.a", ""),))
            return {} if ask("(= short-way short-leaves)") else None

        def attenuated(rules: Any, _: str, asked: Mapping[str, Any], __: Any) -> dict[str, Any]:
            less = _LESS[tuple(rule.id for rule in rules)]
            return {"p": Symbol(application(less, "state", asked["p"].term), ask)}

        def unless(question: str) -> Callable[..., Reason | None]:
            return lambda *_: None if ask(question) else Reason("AE701", "request", "")

        decider = _decider(
            gate,
            ask,
            ask("compiled"),
            decide_straight=decide_straight,
            attenuated=attenuated,
            request_fault=unless("request-formed"),
            check_now=unless("time-formed"),
        )
        # The methods below are explored by themselves.
        decider._objections = lambda _, __, asked, *___: objecting("objections", asked)
        decider._unmet = lambda _, asked, __: objecting("unmet", asked)
        return _decided(decider.decide(caller, readings, action, 0.0, {}))

    return explore(run)


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
