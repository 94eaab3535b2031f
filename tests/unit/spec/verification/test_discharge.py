from __future__ import annotations

from fractions import Fraction
from typing import Any

import pytest

from aeros.spec.backends.oracle import Oracle
from aeros.spec.backends.solver_process import SolverProcess
from aeros.spec.backends.solver_results import SatResult, SolverAnswer
from aeros.spec.diagnostics.codes import SpanLabel
from aeros.spec.diagnostics.source import Source
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL, RealType
from aeros.spec.expr.units import NUMBER
from aeros.spec.model.variables import Declared
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.obligation import ClaimMode, Obligation, VariableSpace
from aeros.spec.obligations.verdicts import Verdict
from aeros.spec.verification.discharge import discharge_obligations

SPAN = Source("site.yaml", "x").span(0, 1)
REAL = RealType(NUMBER)
X = t.Variable("x", REAL, t.VariableRole.STATE)
Y = t.Variable("y", REAL, t.VariableRole.PARAMETER)
B = t.Variable("b", BOOL, t.VariableRole.STATE)
TEN = (Fraction(0), Fraction(10))
DECLARED = (Declared(X, SPAN, range=TEN), Declared(Y, SPAN, range=TEN), Declared(B, SPAN))


def number(value: int | str) -> t.Literal:
    return t.Literal(Fraction(value), REAL)


def obligation(
    conclusion: t.Term, *assumptions: t.Term, claim: ClaimMode = ClaimMode.ALWAYS, **more: Any
) -> Obligation:
    space = VariableSpace(DECLARED, assumptions)
    return Obligation(
        ClaimForm.ENVELOPE_OBEYS("s", "k", "r"),
        "AE501",
        claim,
        space,
        conclusion,
        "h",
        SpanLabel(SPAN),
        **more,
    )


def verdict_of(one: Obligation) -> Verdict:
    (found,) = discharge_obligations([one])
    return found.verdict


def test_ranges_are_assumed_and_closed() -> None:
    assert verdict_of(obligation(t.Compare("<=", X, number(10)))) is Verdict.PROVED
    assert verdict_of(obligation(t.Compare("<", X, number(10)))) is Verdict.REFUTED
    assert verdict_of(obligation(t.Compare("<=", number(0), X))) is Verdict.PROVED
    assert verdict_of(obligation(t.Compare("<", number(0), X))) is Verdict.REFUTED


def test_always_needs_no_case_and_sometimes_needs_one() -> None:
    impossible = t.And((B, t.Not(B)))
    assert verdict_of(obligation(t.FALSE, impossible)) is Verdict.PROVED
    assert verdict_of(obligation(t.TRUE, impossible, claim=ClaimMode.SOMETIMES)) is Verdict.REFUTED
    vacuous = obligation(t.TRUE, impossible, claim=ClaimMode.SOMETIMES, failure_verdict=Verdict.VACUOUS)
    assert verdict_of(vacuous) is Verdict.VACUOUS


def test_a_conclusion_without_variables_is_decided() -> None:
    assert verdict_of(obligation(t.TRUE)) is Verdict.PROVED
    (found,) = discharge_obligations([obligation(t.FALSE)])
    assert found.verdict is Verdict.REFUTED
    assert found.witness is not None
    assert found.witness.lines() == []


def test_the_witness_shows_the_variables_that_matter_and_no_other() -> None:
    (found,) = discharge_obligations([obligation(t.Compare("<=", X, number(7)))])
    assert found.witness is not None
    assert [line.partition(" ")[0] for line in found.witness.lines()] == ["x"]


def test_a_counterexample_is_shown_in_round_numbers() -> None:
    (found,) = discharge_obligations([obligation(t.Compare("<=", X, number("20/3")))])
    assert found.witness is not None
    assert found.witness.lines() == ["x = 8"]  # not ≈7.66666667, which the solver found


def test_guarded_is_refuted_with_a_guard() -> None:
    open_, gated = obligation(B), obligation(B, runtime_checked_rule="r")
    assert [
        one.is_runtime_checked
        for one in discharge_obligations([open_, gated, obligation(t.TRUE, runtime_checked_rule="r")])
    ] == [
        False,
        True,
        False,
    ]


def test_verdicts_come_in_the_order_of_the_questions() -> None:
    found = discharge_obligations([obligation(t.TRUE), obligation(t.FALSE), obligation(t.TRUE)])
    assert [one.verdict for one in found] == [Verdict.PROVED, Verdict.REFUTED, Verdict.PROVED]


def test_an_answer_does_not_depend_on_earlier_queries() -> None:
    first, second = obligation(B, B), obligation(B)
    assert [one.verdict for one in discharge_obligations([first, second])] == [
        Verdict.PROVED,
        Verdict.REFUTED,
    ]


def test_a_recorded_query_names_its_claim_and_its_file() -> None:
    oracle = Oracle(recording=True)
    discharge_obligations([obligation(t.Compare("<=", X, number(7)))], oracle)
    assert [one.description for one in oracle.asked.values()] == ["safety/s/k/r (site.yaml)"]


def test_obligations_are_asked_together_and_counterexamples_that_are_read_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    together, alone = SolverProcess.check_together, SolverProcess.check_sat
    groups: list[int] = []
    singles: list[object] = []

    def counted(solver: SolverProcess, questions: Any, *budget: Any) -> Any:
        groups.append(len(questions))
        return together(solver, questions, *budget)

    def listed(solver: SolverProcess, *question: Any) -> SolverAnswer:
        singles.append(question[2])
        return alone(solver, *question)

    monkeypatch.setattr(SolverProcess, "check_together", counted)
    monkeypatch.setattr(SolverProcess, "check_sat", listed)
    below = t.Compare("<=", X, number(7))
    asked = [
        obligation(below, runtime_checked_rule="r"),
        obligation(below),
        obligation(t.Compare("<=", X, number(10))),
        obligation(t.Compare("<=", X, number(3)), claim=ClaimMode.SOMETIMES),
        obligation(below),
    ]
    verdicts = [one.verdict for one in discharge_obligations(asked)]
    assert verdicts == [Verdict.REFUTED, Verdict.REFUTED, Verdict.PROVED, Verdict.PROVED, Verdict.REFUTED]
    assert groups == [3]  # different questions
    assert len(singles) == 1  # the refuted claim whose counterexample is read


def test_a_spent_budget_is_unknown_and_says_which_budget() -> None:
    product = t.Multiply(X, t.Multiply(Y, Y))
    asked = obligation(t.Compare("<=", product, number(999)))
    (found,) = discharge_obligations([asked], Oracle(1))
    assert found.verdict is Verdict.UNKNOWN
    assert found.obligation is asked
    assert found.witness is None
    assert not found.is_runtime_checked
    assert found.reason.endswith("(rlimit 1)")


def test_an_unknown_is_not_left_to_the_gate() -> None:
    product = t.Multiply(X, t.Multiply(Y, Y))
    never = t.Not(t.Compare("==", product, number(998)))  # beyond what bounds decide
    (found,) = discharge_obligations([obligation(never, runtime_checked_rule="r")], Oracle(1))
    assert found.verdict is Verdict.UNKNOWN
    assert not found.is_runtime_checked


def test_an_irrational_witness_that_does_not_replay_is_unknown() -> None:
    # x * x == 2 holds of no rational number, so no witness can be shown.
    root = t.Compare("==", t.Multiply(X, X), number(2))
    asked = obligation(t.Not(root))
    (found,) = discharge_obligations([asked])
    assert found.verdict is Verdict.UNKNOWN
    assert found.obligation is asked
    assert found.reason == "the solver's witness is irrational and did not replay"
    (found,) = discharge_obligations([obligation(root, claim=ClaimMode.SOMETIMES)])
    assert found.verdict is Verdict.UNKNOWN


def test_a_solver_that_lies_is_not_believed(monkeypatch: pytest.MonkeyPatch) -> None:
    honest = SolverProcess.check_sat

    def lying(*question: Any) -> SolverAnswer:
        answer = honest(*question)
        return SolverAnswer(SatResult.SAT, {"x": Fraction(3)}) if answer.result is SatResult.UNSAT else answer

    monkeypatch.setattr(SolverProcess, "check_sat", lying)
    assert verdict_of(obligation(t.Compare("<=", X, number(10)))) is Verdict.UNKNOWN


def test_a_group_that_lies_is_not_believed(monkeypatch: pytest.MonkeyPatch) -> None:
    lie = SolverAnswer(SatResult.SAT, {"x": Fraction(11)})
    monkeypatch.setattr(SolverProcess, "check_together", lambda *given: [lie] * len(given[1]))
    checked = [obligation(t.Compare("<=", X, number(end)), runtime_checked_rule="r") for end in (9, 10)]
    assert [one.verdict for one in discharge_obligations(checked)] == [Verdict.UNKNOWN] * 2
