"""What every layer permits is allowed: theorem 2."""

from __future__ import annotations

from aeros.spec.theorems.module_copies import Code, Mutant
from aeros.spec.theorems.theorem import Obligation, Table, Theorem
from proofs.lib import gate_fast_path as short_way
from proofs.lib import gate_model as gate


def _decision(code: Code) -> Obligation:
    return Obligation(
        "`_Decider.decide` allows, as it was asked for, an action that no layer objects to.",
        (*gate.DECLARATIONS, *gate.PASSES, gate.OBJECTIONS, *gate.DECISION),
        "(=> (sound asked) (= decision (allow asked)))",
        tables=(Table("decision", "Decision", gate.explore_decision(code)),),
        assumptions={
            "objections": "(=> (passes asked) (= (objections asked) none))",
            "short-way": "(=> (passes asked)"
            " (or (= (short-way asked) short-allows) (= (short-way asked) short-silent)))",
        },
    )


def _objections(code: Code) -> Obligation:
    return Obligation(
        "Where every layer passes, `_Decider._objections` finds nothing; unless a solver that decides each\n"
        "action gives up.",
        (*gate.DECLARATIONS, *gate.PASSES, gate.OBJECTIONS),
        "(=> (passes asked) (= found none))",
        tables=(Table("found", "Objections", gate.explore_objections(code)),),
        assumptions={"solver-decides": gate.SOLVER_DECIDES},
    )


def _criteria(code: Code) -> Obligation:
    return Obligation(
        "Where every layer passes, so does what `_Decider._compile` has the short way decide by.",
        (*gate.DECLARATIONS, *gate.PASSES, *gate.CRITERIA),
        "(=> ((_ is criteria) given)"
        " (and (=> static-layers-pass (allows given)) (=> (passes asked) (left given))))",
        tables=(Table("given", "Criteria", gate.explore_criteria(code)),),
    )


THEOREM = Theorem(
    "what is well-formed, in the envelope, permitted, and allowed by Φ and every site rule, is allowed",
    {
        "decision": _decision,
        "objections": _objections,
        "short-way-criteria": _criteria,
        **short_way.short_way_obligations(short_way.allows_what_holds),
    },
    (
        Mutant(
            "denies-what-the-short-way-is-silent-about",
            "decision",
            gate.GATE,
            "        return self._in_full(caller, readings, action, now, usage)\n",
            "        return Decision(Verdict.DENY, None, ())\n",
        ),
        Mutant(
            "denies-moments-that-the-short-way-is-silent-about",
            "decision",
            gate.GATE,
            "            readings = _one_by_one(readings)\n",
            "            readings = None\n",
        ),
        Mutant(
            "takes-a-quota-for-an-objection",
            "short-way-criteria",
            gate.GATE,
            "Criteria(not always, ",
            "Criteria(not (always or of_quotas), ",
        ),
        Mutant(
            "keeps-one-action-of-a-quota-back",
            "short-way-parameters",
            short_way.STRAIGHT,
            "< {quota.at_most}",
            "< {quota.at_most - 1}",
        ),
    ),
)
