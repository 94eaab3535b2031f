"""An obligation as a script for solvers."""

from __future__ import annotations

from aeros.spec.theorems.symbolic_execution import DecisionNode
from aeros.spec.theorems.theorem import SymbolicFunction, TheoremObligation

DIAGRAM = DecisionNode("(< x 1)", "true", DecisionNode("(< x 2)", "false", "true"))
OBLIGATION = TheoremObligation(
    statement="Far or near.\nNever between.",
    declarations=["(declare-const x Real)"],
    conclusion="(or kept (< x 9))",
    tables=[SymbolicFunction("kept", "Bool", DIAGRAM)],
    lemmas=["(assert (= x x))"],
    assumptions={"low": "(< 0 x)"},
    logic="QF_LRA",
)


def test_a_script_refutes_the_conclusion_under_the_premises_in_order() -> None:
    lines = OBLIGATION.to_smtlib().splitlines()
    assert lines[:5] == [
        "; Far or near.",
        "; Never between.",
        "; unsat: proved",
        "(set-logic QF_LRA)",
        "(declare-const x Real)",
    ]
    assert lines[-4:] == [
        "(assert (= x x))",
        "(assert (! (< 0 x) :named given.low))",
        "(assert (! (not (or kept (< x 9))) :named negated-conclusion))",
        "(check-sat)",
    ]
    assert any(line.startswith("(define-fun kept () Bool") for line in lines[5:-4])
    assert OBLIGATION.to_smtlib().endswith("(check-sat)\n")


def test_the_premises_are_checked_without_the_conclusion() -> None:
    whole, premises = OBLIGATION.to_smtlib().splitlines(), OBLIGATION.premises_to_smtlib().splitlines()
    assert premises == [line for line in whole[3:] if "negated-conclusion" not in line]


def test_a_traced_script_has_a_constant_for_each_question() -> None:
    script, asked = OBLIGATION.to_traced_smtlib()
    assert asked == {"asked.0": "(< x 1)", "asked.1": "(< x 2)"}
    before, _, after = script.partition("(declare-const asked.0 Bool)\n")
    assert before + "(check-sat)\n" == OBLIGATION.to_smtlib()
    assert after == (
        "(assert (= asked.0 (< x 1)))\n"
        "(declare-const asked.1 Bool)\n"
        "(assert (= asked.1 (< x 2)))\n"
        "(check-sat)\n"
    )


def test_an_obligation_needs_no_more_than_a_conclusion() -> None:
    script = TheoremObligation("It holds.", [], "true").to_smtlib()
    assert script == (
        "; It holds.\n; unsat: proved\n(set-logic ALL)\n"
        "(assert (! false :named negated-conclusion))\n(check-sat)\n"
    )
