"""The specialised gate decides as the one that evaluates everything: theorem 6."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any, Final

from aeros.runtime.gate.decision import Reason
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.expr import terms as t
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.verdicts import Verdict
from aeros.spec.theorems.module_copies import ModuleSource, Mutant
from aeros.spec.theorems.smtlib import smt_and, smt_literal
from aeros.spec.theorems.symbolic_execution import DecideBranch, SymbolicValue, execute_symbolically
from aeros.spec.theorems.theorem import SymbolicFunction, Theorem, TheoremObligation
from proofs.lib import gate_model as gate
from proofs.lib.loops import loops_of

CONFIGURATION = "aeros.runtime.gate.configuration"
REPORTS = "aeros.spec.verification.reports"
SAFETY = "aeros.spec.obligations.safety"

_SPECIAL = gate.GateVariant(compiled=True)
_FULL = gate.GateVariant(compiled=True, certified=False)
_SOLVER_GATE = gate.GateVariant(compiled=False, certified=False)

_EVERY_REASON = (
    "(declare-datatypes ((Reasons 0)) (((reasons (form Bool) (finite Bool) (outside Bool) (forbidden Bool)"
    " (breaks-a Bool) (breaks-b Bool)))))"
)
_REASON_CODES = (
    ("AE704", ""),
    ("AE710", ""),
    ("AE730", ""),
    ("AE731", ""),
    ("AE750", "rule.a"),
    ("AE750", "rule.b"),
)


def _reason_flags(reasons: Sequence[Reason]) -> str:
    """Each thing that can object, and whether it does."""
    each = [
        any(one.code == code and rule in ("", one.rule) for one in reasons) for code, rule in _REASON_CODES
    ]
    return f"(reasons {' '.join(map(smt_literal, each))})"


def _execute_variant(code: ModuleSource, variant: gate.GateVariant, name: str) -> SymbolicFunction:
    return SymbolicFunction(name, "Reasons", gate.execute_objections(code, variant, _reason_flags))


def _full_evaluation(code: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "The gate that relies on no certificate finds against a well-formed action exactly what does not\n"
        "hold of it.",
        (*gate.DECLARATIONS, *gate.LAYER_DEFINITIONS, _EVERY_REASON),
        "(=> (well-formed asked) (= full (reasons false (not finite-layers-pass) (not (inside asked))"
        " (not (permitted asked)) (not (obeys-a asked)) (not (obeys-b asked)))))",
        tables=(_execute_variant(code, _FULL, "full"),),
    )


def _decisions_agree(code: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "The gate that leaves out what is proved finds the same reasons against every action, inside the\n"
        "envelope or not, as the gate that evaluates everything.",
        (*gate.DECLARATIONS, *gate.LAYER_DEFINITIONS, _EVERY_REASON),
        "(= special full)",
        tables=(_execute_variant(code, _SPECIAL, "special"), _execute_variant(code, _FULL, "full")),
        assumptions=gate.residue(gate.REQUESTED_ACTION),
    )


def _solved(code: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "It finds the same as the gate that asks Z3 each time, where that gets an answer.",
        (*gate.DECLARATIONS, *gate.LAYER_DEFINITIONS, _EVERY_REASON),
        "(= special asking)",
        tables=(_execute_variant(code, _SPECIAL, "special"), _execute_variant(code, _SOLVER_GATE, "asking")),
        assumptions={
            **gate.residue(gate.REQUESTED_ACTION),
            "z3": "(not compiled)",
            "solver-decides": gate.SOLVER_NEVER_GIVES_UP,
        },
    )


def _fast_path_agrees(code: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "Of a well-formed action of the envelope, what the short way evaluates holds exactly where\n"
        "permission and Φ do.",
        (*gate.DECLARATIONS, *gate.LAYER_DEFINITIONS, *gate.CRITERIA),
        "(=> (and (well-formed asked) (inside asked))"
        " (= (left given) (and (permitted asked) (obeys-a asked) (obeys-b asked))))",
        tables=(SymbolicFunction("given", "Criteria", gate.execute_criteria(code, _SPECIAL)),),
        assumptions=gate.residue(gate.REQUESTED_ACTION),
    )


def _proved(code: ModuleSource) -> TheoremObligation:
    """Make the obligation that a claim counts as proved only by a certificate of this module and site."""
    configuration = code.module(CONFIGURATION)
    subject = ("module", "manifest", "site")

    def run(ask: DecideBranch) -> str:
        of = {name: SymbolicValue(f"certificate.{name}", ask) for name in subject}
        verdict = SymbolicValue("verdict", ask)
        certificate = SimpleNamespace(
            **of, obligations=SimpleNamespace(items=lambda: [("claim", _SymbolicVerdict(verdict))])
        )
        ecm = SimpleNamespace(id=SymbolicValue("module", ask), manifest_digest=SymbolicValue("manifest", ask))
        given = SimpleNamespace(
            modules={"m": ecm},
            certificates={"m": certificate} if ask("certified") else {},
            site=SimpleNamespace(digest=SymbolicValue("site", ask)),
        )
        return smt_literal("claim" in configuration.Configuration.proved_obligations(given, "m"))

    same = smt_and(f"(= certificate.{name} {name})" for name in subject)
    return TheoremObligation(
        "`Configuration.proved_obligations` has a claim exactly where the certificate is of this\n"
        "module, this manifest and this site, and calls the claim PROVED.",
        (
            "(declare-sort Text 0)",
            "(declare-const certified Bool)",
            "(declare-const PROVED Text)",
            "(declare-const verdict Text)",
            *(f"(declare-const {whose}{name} Text)" for name in subject for whose in ("", "certificate.")),
        ),
        f"(= relied-on (and certified {same} (= verdict PROVED)))",
        tables=(SymbolicFunction("relied-on", "Bool", execute_symbolically(run)),),
    )


class _SymbolicVerdict:
    """A verdict as a certificate has it: compared with the word PROVED."""

    def __init__(self, verdict: SymbolicValue) -> None:
        self._verdict = verdict

    def __eq__(self, other: object) -> Any:
        return self._verdict == SymbolicValue(str(other), self._verdict.ask)

    __hash__ = None  # type: ignore[assignment]


def _claim_lookup(code: ModuleSource) -> TheoremObligation:
    """Make the obligation that the claim id which the gate looks up names the proved formula."""
    safety = code.module(SAFETY)

    def run(ask: DecideBranch) -> str:
        envelope, rule_term = (gate.condition_term(name) for name in ("envelope", "rule.a"))
        clause = SimpleNamespace(term=envelope, span=None, conjuncts=(), kind_name="a", text="")
        ecm = SimpleNamespace(id="m", names=SimpleNamespace(parameters={}))
        rule = SimpleNamespace(
            id="rule.a",
            terms={"a": rule_term},
            require_span=None,
            conjuncts={},
            constrains_action=lambda _: True,
        )
        kind = SimpleNamespace(parameters={})
        site = SimpleNamespace(observed_variables={}, kinds={"a": kind})
        skill = SimpleNamespace(
            id="k", inputs={}, runtime_checked={}, precondition=SimpleNamespace(term=t.FALSE)
        )
        space = safety.envelope_space(site, skill, "a", clause)
        made = safety._clause_obeys_rule(ecm, skill, "a", clause, rule, space)
        named = made.id == ClaimForm.ENVELOPE_OBEYS("k", "a", "rule.a") and made.mode.value == "always"
        premises = all(gate.condition_holds(ask, one) for one in made.space.assumptions)
        return smt_literal(named and not (premises and not gate.condition_holds(ask, made.conclusion)))

    return TheoremObligation(
        "What `safety_obligations` proves under the name by which the gate leaves a rule out, is that every\n"
        "action of the envelope obeys it; and nothing else is assumed, so no precondition.",
        (*gate.DECLARATIONS, *gate.LAYER_DEFINITIONS),
        "(= claimed (=> (inside asked) (obeys-a asked)))",
        tables=(SymbolicFunction("claimed", "Bool", execute_symbolically(run)),),
    )


def _claim_name_collision(code: ModuleSource) -> TheoremObligation:
    """Two claims of one identity, which would be a fault of AEROS."""
    reports = code.module(REPORTS)

    def run(ask: DecideBranch) -> str:
        claims = (
            SimpleNamespace(
                id="claim", verdict=Verdict.PROVED, runtime_checked_rule="rule" if ask(one) else None
            )
            for one in ("guarded.1", "guarded.2")
        )
        try:
            reports.certificate_verdicts(claims)
        except InternalError:
            return smt_literal(False)
        return smt_literal(True)

    return TheoremObligation(
        "No certificate is made where two claims have one identity, left to the gate or not.",
        ("(declare-const guarded.1 Bool)", "(declare-const guarded.2 Bool)"),
        "(not certified)",
        tables=(SymbolicFunction("certified", "Bool", execute_symbolically(run)),),
    )


_LOOPS: Final = loops_of(
    "aeros.runtime.gate.gate",
    "aeros.runtime.gate.configuration",
    ("aeros.spec.obligations.safety", ("safety_obligations",)),
    ("aeros.spec.verification.reports", ("certificate_verdicts",)),
)

THEOREM = Theorem(
    "a gate that skips proved conditions decides as a gate that evaluates all conditions",
    {
        "everything": _full_evaluation,
        "same-reasons": _decisions_agree,
        "same-as-z3": _solved,
        "short-way": _fast_path_agrees,
        "relied-on": _proved,
        "claimed": _claim_lookup,
        "named": _claim_name_collision,
        "loops": _LOOPS,
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
            "if claim.id in verdicts:",
            "if not claim:",
        ),
        Mutant(
            "assumes-the-precondition",
            "claimed",
            SAFETY,
            "*skill.inputs.values(), *parameters), (clause.term,)\n    )",
            "*skill.inputs.values(), *parameters), (clause.term, skill.precondition.term)\n    )",
        ),
        Mutant(
            "looks-at-the-first-claims-only",
            "loops",
            "aeros.spec.verification.reports",
            "    for claim in claims:\n        if claim.id in verdicts:",
            "    for claim in islice(claims, 2):\n        if claim.id in verdicts:",
        ),
    ),
)
