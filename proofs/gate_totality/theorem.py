"""Every input has a decision, and what is malformed or unknown is denied: theorem 3."""

from __future__ import annotations

from typing import Final

from aeros.spec.theorems.module_copies import ModuleSource, Mutant
from aeros.spec.theorems.theorem import SymbolicFunction, Theorem, TheoremObligation
from proofs.lib import gate_model as gate
from proofs.lib import gate_validation as forms
from proofs.lib.loops import loops_of


def _decision(code: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "`_Decider.decide` comes to ALLOW, ATTENUATE or DENY on every input; to DENY, without an action,\n"
        "where the request is none, or anything in it is malformed or does not serve.",
        (*gate.DECLARATIONS, *gate.LAYER_DEFINITIONS, gate.OBJECTIONS, *gate.DECISION),
        "(and (not (= decision wrong))"
        " (=> (not (and request-formed time-formed (well-formed asked))) (= decision deny)))",
        tables=(SymbolicFunction("decision", "Decision", gate.execute_decision(code)),),
        assumptions={
            "objections": "(=> (not (well-formed asked)) (= (objections asked) others))",
            "short-way": "(or (= (short-way asked) short-silent)"
            " (and request-formed time-formed (well-formed asked)))",
        },
    )


def _objections(code: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "Where anything is malformed or does not serve, `_Decider._objections` finds more than rules of Φ,\n"
        "so that nothing is attenuated.",
        (*gate.DECLARATIONS, *gate.LAYER_DEFINITIONS, gate.OBJECTIONS),
        "(=> (not (well-formed asked)) (= found others))",
        tables=(SymbolicFunction("found", "Objections", gate.execute_objections(code)),),
    )


def _strangers(code: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "`_Decider.decide` denies to whom it does not know, what it does not know, and what is not in the\n"
        "envelope of the skill; and it raises nothing.",
        (*gate.DECLARATIONS, gate.OBJECTIONS, *gate.DECISION, *gate.UNKNOWN_NAME_DECLARATIONS),
        "(and (not (= decision wrong))"
        " (=> (not (and module-active skill-exists kind-known in-envelope)) (= decision deny)))",
        tables=(SymbolicFunction("decision", "Decision", gate.execute_unknown_request(code)),),
    )


_LOOPS: Final = loops_of(
    "aeros.runtime.gate.gate",
    "aeros.runtime.gate.request_check",
    "aeros.runtime.gate.value_check",
)

THEOREM = Theorem(
    "every input has a decision; malformed or unknown input, or input outside the envelope, is denied",
    {
        "decision": _decision,
        "objections": _objections,
        "strangers": _strangers,
        **forms.validation_obligations(),
        "loops": _LOOPS,
    },
    (
        Mutant(
            "forgets-to-look-at-the-time",
            "decision",
            gate.GATE,
            "fault = request_fault(caller, readings, action, usage) or check_time(now)",
            "fault = request_fault(caller, readings, action, usage)",
        ),
        Mutant(
            "takes-an-infinite-time",
            "time",
            forms.VALUE_CHECK,
            "type(value) in (float, int) and -_EXACT_INTEGERS <= value <= _EXACT_INTEGERS",
            "type(value) in (float, int)",
        ),
        Mutant(
            "lets-any-kind-into-the-envelope",
            "strangers",
            gate.GATE,
            'return [Reason("AE730", action.kind, text), *_failed_reasons(kind.conditions, values)]',
            "return [*_failed_reasons(kind.conditions, values)]",
        ),
        Mutant(
            "fails-at-an-unknown-kind",
            "strangers",
            gate.GATE,
            "required = entry.required_state if entry else kind.required_state if kind else frozenset()",
            "required = entry.required_state if entry else kind.required_state",
        ),
        Mutant(
            "overlooks-the-upper-end-of-a-range",
            "form-of-speed",
            forms.VALUE_CHECK,
            "if not least <= value <= most:",
            "if not least <= value:",
        ),
        Mutant(
            "takes-what-nobody-declared",
            "given",
            forms.REQUEST_CHECK,
            "        if name not in checkers:\n",
            "        if not name:\n",
        ),
        Mutant(
            "checks-two-parameters-only",
            "loops",
            "aeros.runtime.gate.request_check",
            "    for name, form in checkers.items():\n        value = given.get",
            "    for number, (name, form) in enumerate(checkers.items()):\n        value = given.get",
        ),
    ),
)
