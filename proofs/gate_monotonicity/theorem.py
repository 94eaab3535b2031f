"""Overrides win, and whatever is added to a policy or installed beside allows nothing more: theorem 4."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Final

from aeros.spec.theorems.module_copies import ModuleSource, Mutant
from aeros.spec.theorems.theorem import SymbolicFunction, Theorem, TheoremObligation
from proofs.lib import gate_layers as layers
from proofs.lib import gate_model as gate
from proofs.lib.loops import loops_of

_SMALLER_POLICY = gate.GateVariant(rules=("rule.a",), name_prefix="fewer.")


def _override(code: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "Where an operator override matches, `finite_objections` yields it, whatever else there is.",
        layers.LAYER_DECLARATIONS,
        "(=> (not unblocked) told)",
        tables=(
            SymbolicFunction("told", "Bool", layers.execute_layers(code, layers.objects_with_code("AE710"))),
        ),
    )


def _denied(code: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "Where a finite layer objects, as to what is overridden, `_Decider.decide` denies; nothing is\n"
        "attenuated instead.",
        (*gate.DECLARATIONS, *gate.LAYER_DEFINITIONS, gate.OBJECTIONS, *gate.DECISION),
        "(=> (not finite-layers-pass) (= decision deny))",
        tables=(SymbolicFunction("decision", "Decision", gate.execute_decision(code)),),
        assumptions=gate.assume_no_objection(lambda _: "finite-layers-pass"),
    )


def _more_overrides(code: ModuleSource) -> TheoremObligation:
    return _more_layers(
        code,
        "With one override more, `finite_objections` still yields something wherever it did before.",
        layers.SymbolicSite(blocks=("block.1",)),
    )


def _more_quotas(code: ModuleSource) -> TheoremObligation:
    return _more_layers(
        code,
        "With one quota more, `finite_objections` still yields something wherever it did before.",
        layers.SymbolicSite(quotas=("quota.1",)),
    )


def _more_layers(code: ModuleSource, says: str, fewer: layers.SymbolicSite) -> TheoremObligation:
    return TheoremObligation(
        says,
        layers.LAYER_DECLARATIONS,
        "(=> nothing.after nothing.before)",
        tables=(
            SymbolicFunction(
                "nothing.before", "Bool", layers.execute_layers(code, layers.no_objection, fewer)
            ),
            SymbolicFunction("nothing.after", "Bool", layers.execute_layers(code, layers.no_objection)),
        ),
    )


def _more_rules(code: ModuleSource) -> TheoremObligation:
    """Each policy has its own certificates; what they claim is true."""
    return TheoremObligation(
        "With one invariant more, `_Decider._objections` still finds something wherever it did before;\n"
        "unless the solver gave up then, and does not now.",
        (*gate.DECLARATIONS, *gate.LAYER_DEFINITIONS, gate.OBJECTIONS),
        "(=> (= found.after none) (= found.before none))",
        tables=(
            SymbolicFunction("found.before", "Objections", gate.execute_objections(code, _SMALLER_POLICY)),
            SymbolicFunction("found.after", "Objections", gate.execute_objections(code)),
        ),
        assumptions={
            **gate.residue(gate.REQUESTED_ACTION),
            **gate.residue(gate.REQUESTED_ACTION, "fewer."),
            "solver-decides": gate.SOLVER_NEVER_GIVES_UP,
        },
    )


def _more_rules_fast_path(code: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "With one invariant more, the short way still has something to decide by that does not hold of a\n"
        "well-formed action of the envelope, wherever it had before.",
        (*gate.DECLARATIONS, *gate.LAYER_DEFINITIONS, *gate.CRITERIA),
        "(=> (and ((_ is criteria) after) (well-formed asked) (inside asked) (allows after) (left after))"
        " (and (allows before) (left before)))",
        tables=(
            SymbolicFunction("before", "Criteria", gate.execute_criteria(code, _SMALLER_POLICY)),
            SymbolicFunction("after", "Criteria", gate.execute_criteria(code)),
        ),
        assumptions={**gate.residue(gate.REQUESTED_ACTION), **gate.residue(gate.REQUESTED_ACTION, "fewer.")},
    )


_OTHER_MODULES = {"before": ("another", "m"), "after": ("m", "another")}


def _another_module(place: str, code: ModuleSource) -> TheoremObligation:
    """In whichever order they are made ready."""
    both = gate.GateVariant(modules=_OTHER_MODULES[place])
    return TheoremObligation(
        f"With another module installed, made ready {place} it, `_Decider._objections` finds the same\n"
        "against what a module asks for, and the short way has the same to decide by.",
        (*gate.DECLARATIONS, *gate.LAYER_DEFINITIONS, gate.OBJECTIONS, *gate.CRITERIA),
        "(and (= found.beside found.alone) (= given.beside given.alone))",
        tables=(
            SymbolicFunction("found.alone", "Objections", gate.execute_objections(code)),
            SymbolicFunction("found.beside", "Objections", gate.execute_objections(code, both)),
            SymbolicFunction("given.alone", "Criteria", gate.execute_criteria(code)),
            SymbolicFunction("given.beside", "Criteria", gate.execute_criteria(code, both)),
        ),
    )


_OBLIGATIONS: dict[str, Callable[[ModuleSource], TheoremObligation]] = {
    f"another-module-{place}": partial(_another_module, place) for place in _OTHER_MODULES
}

_LOOPS: Final = loops_of(
    "aeros.runtime.gate.gate",
    "aeros.runtime.gate.finite_layers",
)

THEOREM = Theorem(
    "an override wins; an added rule, override, quota or module allows nothing more",
    {
        "override": _override,
        "denied": _denied,
        "more-overrides": _more_overrides,
        "more-quotas": _more_quotas,
        "more-rules": _more_rules,
        "more-rules-short-way": _more_rules_fast_path,
        **_OBLIGATIONS,
        "loops": _LOOPS,
    },
    (
        Mutant(
            "has-the-latest-override-replace-the-others",
            "more-overrides",
            layers.LAYERS,
            "for block in site.blocks:",
            "for block in site.blocks[-1:]:",
        ),
        Mutant(
            "attenuates-what-the-operator-blocks",
            "denied",
            gate.GATE,
            "if not self._objections(caller, readings, reduced, now, usage, {}):",
            "if not self._violated_conditions(caller, reduced, {}):",
        ),
        Mutant(
            "evaluates-the-latest-rule-alone",
            "more-rules",
            gate.GATE,
            "if obligation not in proved]",
            "if obligation not in proved][-2:]",
        ),
        Mutant(
            "relies-on-what-is-proved-of-any-module",
            "another-module-after",
            gate.GATE,
            "self._configuration.proved_obligations(ecm.id) if relied_on",
            "self._configuration.proved_obligations(min(self._configuration.modules)) if relied_on",
        ),
        Mutant(
            "stops-at-the-first-quota",
            "loops",
            "aeros.runtime.gate.finite_layers",
            "            yield from _quota_objections(quota, usage)\n",
            "            yield from _quota_objections(quota, usage)\n            break\n",
        ),
    ),
)
