"""Overrides win, and whatever is added to a policy or installed beside allows nothing more: theorem 4."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from aeros.spec.theorems.module_copies import Code, Mutant
from aeros.spec.theorems.theorem import Obligation, Table, Theorem
from proofs.lib import gate_layers as layers
from proofs.lib import gate_model as gate

_FEWER = gate.Variant(rules=("rule.a",), under="fewer.")


def _override(code: Code) -> Obligation:
    return Obligation(
        "Where an operator override matches, `finite_objections` yields it, whatever else there is.",
        layers.TOGETHER,
        "(=> (not unblocked) told)",
        tables=(Table("told", "Bool", layers.explore_together(code, layers.telling("AE710"))),),
    )


def _denied(code: Code) -> Obligation:
    return Obligation(
        "Where a finite layer objects, as to what is overridden, `_Decider.decide` denies; nothing is\n"
        "attenuated instead.",
        (*gate.DECLARATIONS, *gate.PASSES, gate.OBJECTIONS, *gate.DECISION),
        "(=> (not finite-layers-pass) (= decision deny))",
        tables=(Table("decision", "Decision", gate.explore_decision(code)),),
        assumptions=gate.where_nothing_objects(lambda _: "finite-layers-pass"),
    )


def _more_overrides(code: Code) -> Obligation:
    return _more_layers(
        code,
        "With one override more, `finite_objections` still yields something wherever it did before.",
        layers.Site(blocks=("block.1",)),
    )


def _more_quotas(code: Code) -> Obligation:
    return _more_layers(
        code,
        "With one quota more, `finite_objections` still yields something wherever it did before.",
        layers.Site(quotas=("quota.1",)),
    )


def _more_layers(code: Code, says: str, fewer: layers.Site) -> Obligation:
    return Obligation(
        says,
        layers.TOGETHER,
        "(=> nothing.after nothing.before)",
        tables=(
            Table("nothing.before", "Bool", layers.explore_together(code, layers.passing, fewer)),
            Table("nothing.after", "Bool", layers.explore_together(code, layers.passing)),
        ),
    )


def _more_rules(code: Code) -> Obligation:
    """Each policy has its own certificates; what they claim is true."""
    return Obligation(
        "With one invariant more, `_Decider._objections` still finds something wherever it did before;\n"
        "unless the solver gave up then, and does not now.",
        (*gate.DECLARATIONS, *gate.PASSES, gate.OBJECTIONS),
        "(=> (= found.after none) (= found.before none))",
        tables=(
            Table("found.before", "Objections", gate.explore_objections(code, _FEWER)),
            Table("found.after", "Objections", gate.explore_objections(code)),
        ),
        assumptions={
            **gate.residue(gate.ASKED),
            **gate.residue(gate.ASKED, "fewer."),
            "solver-decides": gate.SOLVER_DECIDES,
        },
    )


def _more_rules_short(code: Code) -> Obligation:
    return Obligation(
        "With one invariant more, the short way still has something to decide by that does not hold of a\n"
        "well-formed action of the envelope, wherever it had before.",
        (*gate.DECLARATIONS, *gate.PASSES, *gate.CRITERIA),
        "(=> (and ((_ is criteria) after) (well-formed asked) (inside asked) (allows after) (left after))"
        " (and (allows before) (left before)))",
        tables=(
            Table("before", "Criteria", gate.explore_criteria(code, _FEWER)),
            Table("after", "Criteria", gate.explore_criteria(code)),
        ),
        assumptions={**gate.residue(gate.ASKED), **gate.residue(gate.ASKED, "fewer.")},
    )


_BESIDE = {"before": ("another", "m"), "after": ("m", "another")}


def _another_module(place: str, code: Code) -> Obligation:
    """In whichever order they are made ready."""
    both = gate.Variant(modules=_BESIDE[place])
    return Obligation(
        f"With another module installed, made ready {place} it, `_Decider._objections` finds the same\n"
        "against what a module asks for, and the short way has the same to decide by.",
        (*gate.DECLARATIONS, *gate.PASSES, gate.OBJECTIONS, *gate.CRITERIA),
        "(and (= found.beside found.alone) (= given.beside given.alone))",
        tables=(
            Table("found.alone", "Objections", gate.explore_objections(code)),
            Table("found.beside", "Objections", gate.explore_objections(code, both)),
            Table("given.alone", "Criteria", gate.explore_criteria(code)),
            Table("given.beside", "Criteria", gate.explore_criteria(code, both)),
        ),
    )


_MADE: dict[str, Callable[[Code], Obligation]] = {
    f"another-module-{place}": partial(_another_module, place) for place in _BESIDE
}

THEOREM = Theorem(
    "an override wins; a rule, override, quota or module that is added allows nothing more",
    {
        "override": _override,
        "denied": _denied,
        "more-overrides": _more_overrides,
        "more-quotas": _more_quotas,
        "more-rules": _more_rules,
        "more-rules-short-way": _more_rules_short,
        **_MADE,
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
            "if not self._unmet(caller, reduced, {}):",
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
            "self._configuration.proved(ecm.id) if relied_on",
            "self._configuration.proved(min(self._configuration.modules)) if relied_on",
        ),
    ),
)
