"""An action that every layer permits is allowed: theorem 2."""

from __future__ import annotations

from typing import Final

from aeros.spec.theorems.module_copies import ModuleSource, Mutant
from aeros.spec.theorems.theorem import SymbolicFunction, Theorem, TheoremObligation
from proofs.lib import gate_fast_path as short_way
from proofs.lib import gate_model as gate
from proofs.lib.loops import loops_of


def _decision(code: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "`_Decider.decide` allows, as it was asked for, an action that no layer objects to.",
        (*gate.DECLARATIONS, *gate.LAYER_DEFINITIONS, gate.OBJECTIONS, *gate.DECISION),
        "(=> (sound asked) (= decision (allow asked)))",
        tables=(SymbolicFunction("decision", "Decision", gate.execute_decision(code)),),
        assumptions={
            "objections": "(=> (passes asked) (= (objections asked) none))",
            "short-way": "(=> (passes asked)"
            " (or (= (short-way asked) short-allows) (= (short-way asked) short-silent)))",
        },
    )


def _objections(code: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "Where every layer passes, `_Decider._objections` finds nothing; unless a solver that decides each\n"
        "action gives up.",
        (*gate.DECLARATIONS, *gate.LAYER_DEFINITIONS, gate.OBJECTIONS),
        "(=> (passes asked) (= found none))",
        tables=(SymbolicFunction("found", "Objections", gate.execute_objections(code)),),
        assumptions={"solver-decides": gate.SOLVER_NEVER_GIVES_UP},
    )


def _criteria(code: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "Where every layer passes, so does what `_Decider._compile` has the short way decide by.",
        (*gate.DECLARATIONS, *gate.LAYER_DEFINITIONS, *gate.CRITERIA),
        "(=> ((_ is criteria) given)"
        " (and (=> static-layers-pass (allows given)) (=> (passes asked) (left given))))",
        tables=(SymbolicFunction("given", "Criteria", gate.execute_criteria(code)),),
    )


_LOOPS: Final = loops_of(
    "aeros.runtime.gate.gate",
    "aeros.runtime.gate.compiled.fast_path",
    "aeros.runtime.gate.compiled.codegen",
)

THEOREM = Theorem(
    "a well-formed, permitted action in the envelope that Φ and every site rule allow is allowed",
    {
        "decision": _decision,
        "objections": _objections,
        "short-way-criteria": _criteria,
        **short_way.fast_path_obligations(short_way.conditions_imply_allow),
        "loops": _LOOPS,
    },
    (
        Mutant(
            "denies-what-the-short-way-is-silent-about",
            "decision",
            gate.GATE,
            "        return self._decide_slow_path(caller, readings, action, now, usage)\n",
            "        return Decision(DecisionKind.DENY, None, ())\n",
        ),
        Mutant(
            "denies-moments-that-the-short-way-is-silent-about",
            "decision",
            gate.GATE,
            "            readings = individual_readings(readings)\n",
            "            readings = None\n",
        ),
        Mutant(
            "takes-a-quota-for-an-objection",
            "short-way-criteria",
            gate.GATE,
            "DecisionCriteria(\n                    not always,",
            "DecisionCriteria(\n                    not (always or of_quotas),",
        ),
        Mutant(
            "keeps-one-action-of-a-quota-back",
            "short-way-parameters",
            short_way.FAST_PATH,
            "< {quota.max_count}",
            "< {quota.max_count - 1}",
        ),
        Mutant(
            "objects-from-the-third-condition-on",
            "loops",
            "aeros.runtime.gate.gate",
            "    for condition, reason in conditions:\n",
            "    for number, (condition, reason) in enumerate(conditions):\n",
        ),
    ),
)
