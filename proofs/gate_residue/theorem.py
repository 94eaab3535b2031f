"""The specialised gate decides as the one that evaluates everything: theorem 6."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

from aeros.runtime.gate.decision import Reason
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.expr import terms as t
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.verdicts import Verdict
from aeros.spec.theorems.module_copies import Code, Mutant
from aeros.spec.theorems.smtlib import conjunction, literal
from aeros.spec.theorems.symbolic_execution import Ask, Symbol, explore
from aeros.spec.theorems.theorem import Obligation, Table, Theorem
from proofs.lib import gate_model as gate

CONFIGURATION = "aeros.runtime.gate.configuration"
REPORTS = "aeros.spec.verification.reports"
SAFETY = "aeros.spec.obligations.safety"

_SPECIAL = gate.Variant(compiled=True)
_FULL = gate.Variant(compiled=True, certified=False)
_ASKING = gate.Variant(compiled=False, certified=False)

_EVERY_REASON = (
    "(declare-datatypes ((Reasons 0)) (((reasons (form Bool) (finite Bool) (outside Bool) (forbidden Bool)"
    " (breaks-a Bool) (breaks-b Bool)))))"
)
_TOLD = (("AE704", ""), ("AE710", ""), ("AE730", ""), ("AE731", ""), ("AE750", "rule.a"), ("AE750", "rule.b"))


def _every_reason(found: Sequence[Reason]) -> str:
    """Each thing that can object, and whether it does."""
    each = [any(one.code == code and rule in ("", one.rule) for one in found) for code, rule in _TOLD]
    return f"(reasons {' '.join(map(literal, each))})"


def _told(code: Code, variant: gate.Variant, name: str) -> Table:
    return Table(name, "Reasons", gate.explore_objections(code, variant, _every_reason))


def _everything(code: Code) -> Obligation:
    return Obligation(
        "The gate that relies on no certificate finds against a well-formed action exactly what does not\n"
        "hold of it.",
        (*gate.DECLARATIONS, *gate.PASSES, _EVERY_REASON),
        "(=> (well-formed asked) (= full (reasons false (not finite-layers-pass) (not (inside asked))"
        " (not (permitted asked)) (not (obeys-a asked)) (not (obeys-b asked)))))",
        tables=(_told(code, _FULL, "full"),),
    )


def _same(code: Code) -> Obligation:
    return Obligation(
        "The gate that leaves out what is proved finds the same reasons against every action, inside the\n"
        "envelope or not, as the gate that evaluates everything.",
        (*gate.DECLARATIONS, *gate.PASSES, _EVERY_REASON),
        "(= special full)",
        tables=(_told(code, _SPECIAL, "special"), _told(code, _FULL, "full")),
        assumptions=gate.residue(gate.ASKED),
    )


def _solved(code: Code) -> Obligation:
    return Obligation(
        "It finds the same as the gate that asks Z3 each time, where that gets an answer.",
        (*gate.DECLARATIONS, *gate.PASSES, _EVERY_REASON),
        "(= special asking)",
        tables=(_told(code, _SPECIAL, "special"), _told(code, _ASKING, "asking")),
        assumptions={
            **gate.residue(gate.ASKED),
            "z3": "(not compiled)",
            "solver-decides": gate.SOLVER_DECIDES,
        },
    )


def _short_way(code: Code) -> Obligation:
    return Obligation(
        "Of a well-formed action of the envelope, what the short way evaluates holds exactly where\n"
        "permission and Φ do.",
        (*gate.DECLARATIONS, *gate.PASSES, *gate.CRITERIA),
        "(=> (and (well-formed asked) (inside asked))"
        " (= (left given) (and (permitted asked) (obeys-a asked) (obeys-b asked))))",
        tables=(Table("given", "Criteria", gate.explore_criteria(code, _SPECIAL)),),
        assumptions=gate.residue(gate.ASKED),
    )


def _proved(code: Code) -> Obligation:
    """What `Configuration.proved` relies on a certificate for."""
    configuration = code.module(CONFIGURATION)
    subject = ("module", "manifest", "site")

    def run(ask: Ask) -> str:
        of = {name: Symbol(f"certificate.{name}", ask) for name in subject}
        verdict = Symbol("verdict", ask)
        certificate = SimpleNamespace(
            **of, obligations=SimpleNamespace(items=lambda: [("claim", _Verdict(verdict))])
        )
        ecm = SimpleNamespace(id=Symbol("module", ask), manifest_digest=Symbol("manifest", ask))
        given = SimpleNamespace(
            modules={"m": ecm},
            certificates={"m": certificate} if ask("certified") else {},
            site=SimpleNamespace(digest=Symbol("site", ask)),
        )
        return literal("claim" in configuration.Configuration.proved(given, "m"))

    same = conjunction(f"(= certificate.{name} {name})" for name in subject)
    return Obligation(
        "`Configuration.proved` has a claim exactly where the certificate is of this module, this manifest\n"
        "and this site, and calls the claim PROVED.",
        (
            "(declare-sort Text 0)",
            "(declare-const certified Bool)",
            "(declare-const PROVED Text)",
            "(declare-const verdict Text)",
            *(f"(declare-const {whose}{name} Text)" for name in subject for whose in ("", "certificate.")),
        ),
        f"(= relied-on (and certified {same} (= verdict PROVED)))",
        tables=(Table("relied-on", "Bool", explore(run)),),
    )


class _Verdict:
    """A verdict as a certificate has it: compared with the word PROVED."""

    def __init__(self, verdict: Symbol) -> None:
        self._verdict = verdict

    def __eq__(self, other: object) -> Any:
        return self._verdict == Symbol(str(other), self._verdict.ask)

    __hash__ = None  # type: ignore[assignment]


def _claimed(code: Code) -> Obligation:
    """What is proved under the name that the gate asks for."""
    safety = code.module(SAFETY)

    def run(ask: Ask) -> str:
        envelope, rule_term = (gate.variable(name) for name in ("envelope", "rule.a"))
        clause = SimpleNamespace(term=envelope, span=None, conjuncts=())
        rule = SimpleNamespace(
            id="rule.a",
            terms={"a": rule_term},
            require_span=None,
            conjuncts={},
            speaks_of_action=lambda _: True,
        )
        kind = SimpleNamespace(parameters={})
        site = SimpleNamespace(observed={}, kinds={"a": kind})
        skill = SimpleNamespace(id="k", inputs={}, gated=(), precondition=SimpleNamespace(term=t.FALSE))
        space = safety.envelope_space(site, skill, "a", clause)
        made = safety._obeys(skill, "a", clause, rule, space)
        named = made.id == ClaimForm.ENVELOPE_OBEYS("k", "a", "rule.a") and made.claim.value == "always"
        premises = all(gate.holds(ask, one) for one in made.space.assumptions)
        return literal(named and not (premises and not gate.holds(ask, made.conclusion)))

    return Obligation(
        "What `safety_obligations` proves under the name by which the gate leaves a rule out, is that every\n"
        "action of the envelope obeys it; and nothing else is assumed, so no precondition.",
        (*gate.DECLARATIONS, *gate.PASSES),
        "(= claimed (=> (inside asked) (obeys-a asked)))",
        tables=(Table("claimed", "Bool", explore(run)),),
    )


def _named(code: Code) -> Obligation:
    """Two claims of one identity, which would be a fault of AEROS."""
    reports = code.module(REPORTS)

    def run(ask: Ask) -> str:
        claims = (
            SimpleNamespace(id="claim", verdict=Verdict.PROVED, guard="rule" if ask(one) else None)
            for one in ("guarded.1", "guarded.2")
        )
        try:
            reports.verdicts_of(claims)
        except InternalError:
            return literal(False)
        return literal(True)

    return Obligation(
        "No certificate is made where two claims have one identity, left to the gate or not.",
        ("(declare-const guarded.1 Bool)", "(declare-const guarded.2 Bool)"),
        "(not certified)",
        tables=(Table("certified", "Bool", explore(run)),),
    )


THEOREM = Theorem(
    "the gate that leaves out what is proved decides as the gate that evaluates everything",
    {
        "everything": _everything,
        "same-reasons": _same,
        "same-as-z3": _solved,
        "short-way": _short_way,
        "relied-on": _proved,
        "claimed": _claimed,
        "named": _named,
    },
    (
        Mutant(
            "leaves-out-what-is-not-proved",
            "everything",
            gate.GATE,
            "if obligation not in proved]",
            "if obligation in proved]",
        ),
        Mutant(
            "takes-the-proof-of-one-rule-for-that-of-all",
            "same-reasons",
            gate.GATE,
            "if obligation not in proved]",
            "if not any(one in proved for one in claims)]",
        ),
        Mutant(
            "relies-on-the-certificate-of-another-site",
            "relied-on",
            CONFIGURATION,
            "subject = (ecm.id, ecm.manifest_digest, self.site.digest)",
            "subject = (ecm.id, ecm.manifest_digest, certificate and certificate.site)",
        ),
        Mutant(
            "has-the-latter-of-two-claims-count",
            "named",
            REPORTS,
            "if told.id in verdicts:",
            "if not told:",
        ),
        Mutant(
            "assumes-the-precondition",
            "claimed",
            SAFETY,
            "(*site.observed.values(), *skill.inputs.values(), *parameters), (clause.term,))",
            "(*site.observed.values(), *skill.inputs.values(), *parameters),"
            " (clause.term, skill.precondition.term))",
        ),
    ),
)
