"""Every action that the gate forwards satisfies every layer: theorem 1."""

from __future__ import annotations

from typing import Final

from aeros.spec.theorems.module_copies import ModuleSource, Mutant
from aeros.spec.theorems.theorem import SymbolicFunction, Theorem, TheoremObligation
from proofs.gate_soundness.plant_parameters import REQUEST_CHECK, plant_parameters
from proofs.lib import gate_fast_path as short_way
from proofs.lib import gate_layers as layers
from proofs.lib import gate_model as gate
from proofs.lib import gate_snapshots
from proofs.lib.loops import loops_of


def _decision(code: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "`_Decider.decide` forwards nothing but an action of which every layer passes, of a request that is\n"
        "one; else it denies, and gives no action.",
        (*gate.DECLARATIONS, *gate.LAYER_DEFINITIONS, gate.OBJECTIONS, *gate.DECISION),
        "(or (= decision deny)"
        " (and ((_ is allow) decision) (sound (allowed decision)) (= (allowed decision) asked))"
        " (and ((_ is attenuate) decision) (sound (reduced decision))))",
        tables=(SymbolicFunction("decision", "Decision", gate.execute_decision(code)),),
        assumptions=gate.assume_no_objection(lambda one: f"(passes {one})"),
    )


def _objections(code: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "Where `_Decider._objections` finds nothing, every layer passes: what it evaluates, and what the\n"
        "certificate says is proved of the envelope.",
        (*gate.DECLARATIONS, *gate.LAYER_DEFINITIONS, gate.OBJECTIONS),
        "(=> (= found none) (passes asked))",
        tables=(SymbolicFunction("found", "Objections", gate.execute_objections(code)),),
        assumptions=gate.residue(gate.REQUESTED_ACTION),
    )


def _criteria(code: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "What `_Decider._compile` has the short way decide by: where that holds inside the envelope, so do\n"
        "permission and Φ, and it allows nothing where a finite layer objects whatever has been used up.",
        (*gate.DECLARATIONS, *gate.LAYER_DEFINITIONS, *gate.CRITERIA),
        "(=> ((_ is criteria) given) (and (=> (allows given) static-layers-pass)"
        " (=> (and (well-formed asked) (inside asked) (left given))"
        " (and (permitted asked) (obeys-a asked) (obeys-b asked)))))",
        tables=(SymbolicFunction("given", "Criteria", gate.execute_criteria(code)),),
        assumptions=gate.residue(gate.REQUESTED_ACTION),
    )


_OBLIGATIONS: Final = {
    "decision": _decision,
    "objections": _objections,
    **layers.layer_obligations(),
    "plant-parameters": plant_parameters,
    "short-way-criteria": _criteria,
    **short_way.fast_path_obligations(short_way.allow_implies_conditions),
    **gate_snapshots.snapshot_obligations(),
}

_LOOPS: Final = loops_of(
    "aeros.runtime.gate.gate",
    "aeros.runtime.gate.finite_layers",
    "aeros.runtime.gate.request_check",
    "aeros.runtime.gate.value_check",
    "aeros.runtime.gate.configuration",
    "aeros.runtime.gate.conditions",
    "aeros.runtime.gate.compiled.fast_path",
    "aeros.runtime.gate.compiled.codegen",
    "aeros.spec.model.policy",
    "aeros.spec.model.site",
)

THEOREM = Theorem(
    "forwarded actions satisfy Φ, P_i, the envelope and every site rule; all others become ⊥",
    {**_OBLIGATIONS, "loops": _LOOPS},
    (
        Mutant(
            "forwards-what-is-reduced-without-deciding-it",
            "decision",
            gate.GATE,
            "if not self._objections(caller, readings, reduced, now, usage, {}):",
            "if reduced:",
        ),
        Mutant(
            "relies-on-an-envelope-that-is-not-checked",
            "objections",
            gate.GATE,
            "sufficient = t.conjunction(envelope, *left)",
            "sufficient = t.conjunction(*left)",
        ),
        Mutant(
            "blocks-only-where-every-field-is-given",
            "override",
            layers.POLICY,
            "all(mine is None or mine == theirs for mine, theirs in pairs)",
            "all(mine is not None and mine == theirs for mine, theirs in pairs)",
        ),
        Mutant(
            "moves-what-the-site-did-not-give",
            "access",
            layers.LAYERS,
            "skill.actuators & ecm.requested_access.actuators & granted.actuators",
            "skill.actuators & ecm.requested_access.actuators",
        ),
        Mutant(
            "calls-over-a-channel-that-the-site-did-not-give",
            "access",
            layers.LAYERS,
            "kind.channels - (ecm.requested_access.channels & granted.channels)",
            "kind.channels - ecm.requested_access.channels",
        ),
        Mutant(
            "bears-what-a-skill-declares-whatever-the-site-does",
            "risk",
            layers.LAYERS,
            "if skill.risk > site.risk_ceiling:",
            "if kind.risk > site.risk_ceiling:",
        ),
        Mutant(
            "counts-with-what-is-no-count",
            "counts",
            layers.LAYERS,
            "return type(used) is int and used >= 0",
            "return used >= 0",
        ),
        Mutant(
            "overlooks-the-last-action-of-a-quota",
            "quota",
            layers.LAYERS,
            "used >= quota.max_count",
            "used > quota.max_count",
        ),
        Mutant(
            "forgets-the-age-of-a-reading-with-a-time-of-its-own",
            "short-way-reading",
            short_way.FAST_PATH,
            'self.write_guard(f"age < {checkers[name].surely_fresh!r}")',
            'self.write_guard(f"age >= 0 or age < {checkers[name].surely_fresh!r}")',
        ),
        Mutant(
            "forgets-the-age-of-a-moment",
            "short-way-reading",
            short_way.FAST_PATH,
            'self.write_guard(f"exactly - time < {min(limits)!r}")',
            "pass",
        ),
        Mutant(
            "takes-a-moment-for-well-formed",
            "short-way-reading",
            short_way.FAST_PATH,
            'self.write_guard("taken is not None")',
            "pass",
        ),
        Mutant(
            "takes-readings-for-well-formed",
            "short-way-reading",
            short_way.FAST_PATH,
            'self.write_guard("several is not None")',
            "pass",
        ),
        Mutant(
            "takes-one-value-of-a-moment-for-all",
            "short-way-readings",
            short_way.FAST_PATH,
            "taken[{scalar!r}]",
            "taken[{min(required)!r}]",
        ),
        Mutant(
            "keeps-what-was-measured-under-other-names",
            "moment",
            gate_snapshots.SNAPSHOTS,
            "if cached is None or cached.order is not order:",
            "if cached is None:",
        ),
        Mutant(
            "trusts-a-list-to-stay-as-it-was",
            "moment",
            gate_snapshots.SNAPSHOTS,
            "if unpack is None or type(value) is list else",
            "if unpack is None else",
        ),
        Mutant(
            "turns-a-list-round",
            "plant-parameters",
            REQUEST_CHECK,
            "tuple(_to_plant_value(part) for part in value)",
            "tuple(_to_plant_value(part) for part in reversed(value))",
        ),
        Mutant(
            "turns-the-sign-of-a-whole-number",
            "plant-parameters",
            REQUEST_CHECK,
            "        return float(value)\n",
            "        return -float(value)\n",
        ),
        Mutant(
            "forgets-overrides-after-the-second",
            "loops",
            "aeros.runtime.gate.finite_layers",
            "for block in site.blocks:",
            "for block in site.blocks[:2]:",
        ),
        Mutant(
            "forgets-rules-after-the-second",
            "loops",
            "aeros.runtime.gate.gate",
            "rules = self._configuration.site.rules_for_kind(kind.name)",
            "rules = self._configuration.site.rules_for_kind(kind.name)[:2]",
        ),
    ),
)
