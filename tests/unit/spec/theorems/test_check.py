"""Obligations are proved, refuted with a witness, or vacuous; solvers must agree, and mutants must fail."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import pytest

from aeros.spec.backends.solver_results import SatResult, SolverAnswer
from aeros.spec.diagnostics.errors import DisagreementError, InternalError
from aeros.spec.obligations.verdicts import Verdict
from aeros.spec.theorems import check
from aeros.spec.theorems.check import (
    MutantResult,
    SolverPanel,
    TheoremObligationResult,
    check_mutants,
    check_theorem,
)
from aeros.spec.theorems.module_copies import ModuleSource, Mutant
from aeros.spec.theorems.symbolic_execution import DecisionNode
from aeros.spec.theorems.theorem import SymbolicFunction, Theorem, TheoremObligation

SMALL = SymbolicFunction(
    "small", "Bool", DecisionNode("(< x 3)", "true", DecisionNode("(< x 5)", "true", "false"))
)


def claim(conclusion: str, **assumptions: str) -> TheoremObligation:
    return TheoremObligation(
        "A claim.", ["(declare-const x Int)"], conclusion, [SMALL], assumptions=assumptions
    )


PROVED, REFUTED, VACUOUS = (
    claim("(=> (< x 4) small)"),
    claim("small", at="(= x 7)"),
    claim("false", low="(< x 0)", high="(< 0 x)"),
)


class Sayer:
    """A second solver that says the same of every script but of those with a word."""

    name = "second 1.0"

    def __init__(self, result: SatResult, reason: str = "", premises: SatResult = SatResult.SAT) -> None:
        self._answer = SolverAnswer(result, {}, reason)
        self._premises = SolverAnswer(premises, {})
        self.asked: list[str] = []

    def solve_script(self, script: str) -> SolverAnswer:
        self.asked.append(script)
        return self._answer if "negated-conclusion" in script else self._premises


def test_a_claim_is_proved_with_the_assertions_it_takes() -> None:
    found = SolverPanel().check("it", PROVED)
    assert (found.name, found.verdicts, found.verdict) == ("it", {"z3": Verdict.PROVED}, Verdict.PROVED)
    assert (found.unsat_core, found.witness, found.reason) == (1, None, "")
    assert found.rlimit_used > 0


def test_a_claim_is_refuted_with_an_input_and_the_way_of_the_code_on_it() -> None:
    found = SolverPanel().check("it", REFUTED)
    assert found.verdict is Verdict.REFUTED
    assert found.witness is not None
    assert found.witness.constants == {"x": "7"}
    asked, result = found.witness.paths["small"]
    assert (list(asked), result) == ([("(< x 3)", False), ("(< x 5)", False)], "false")


def test_a_claim_under_assumptions_that_exclude_every_input_is_vacuous() -> None:
    assert SolverPanel().check("it", VACUOUS).verdicts == {"z3": Verdict.VACUOUS}
    second = Sayer(SatResult.UNSAT)
    assert SolverPanel(second=second).check("it", VACUOUS).verdicts == dict.fromkeys(
        ("z3", "second"), Verdict.VACUOUS
    )


def test_a_second_solver_alone_decides_and_checks_the_assumptions() -> None:
    for result, premises, verdict in (
        (SatResult.UNSAT, SatResult.SAT, Verdict.PROVED),
        (SatResult.UNSAT, SatResult.UNSAT, Verdict.VACUOUS),
        (SatResult.UNSAT, SatResult.UNKNOWN, Verdict.UNKNOWN),
        (SatResult.SAT, SatResult.SAT, Verdict.REFUTED),
        (SatResult.UNKNOWN, SatResult.SAT, Verdict.UNKNOWN),
    ):
        second = Sayer(result, premises=premises)
        found = SolverPanel(z3=False, second=second).check("it", PROVED)
        assert (found.verdicts, found.verdict) == ({"second": verdict}, verdict)
        assert (found.unsat_core, found.rlimit_used, found.witness) == (0, 0, None)
        asked = [PROVED.to_smtlib(), PROVED.premises_to_smtlib()]
        assert second.asked == (asked if result is SatResult.UNSAT else asked[:1])


def test_solvers_that_disagree_stop_the_run() -> None:
    with pytest.raises(DisagreementError, match=r"about it differ: z3 says PROVED, but second says REFUTED"):
        SolverPanel(second=Sayer(SatResult.SAT)).check("it", PROVED)
    with pytest.raises(DisagreementError):
        SolverPanel(second=Sayer(SatResult.UNSAT)).check("it", REFUTED)


def test_a_solver_that_gives_up_says_why_and_leaves_the_claim_undecided() -> None:
    found = SolverPanel(second=Sayer(SatResult.UNKNOWN, "out of time")).check("it", PROVED)
    assert found.verdicts == {"z3": Verdict.PROVED, "second": Verdict.UNKNOWN}
    assert (found.verdict, found.reason) == (Verdict.UNKNOWN, "second 1.0: out of time")


def test_a_budget_that_runs_out_is_undecided(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(check, "RLIMIT", 1)
    hard = TheoremObligation(
        "", ["(declare-const x Int)", "(declare-const y Int)"], "(not (= (* x x x) (+ (* y y) 7)))"
    )
    found = SolverPanel().check("it", hard)
    assert found.verdict is Verdict.UNKNOWN
    assert found.reason.startswith("z3: ")


def test_the_solvers_are_named_with_their_versions() -> None:
    (first,) = SolverPanel().names
    assert first.startswith("z3 ")
    assert SolverPanel(second=Sayer(SatResult.SAT)).names == (first, "second 1.0")
    assert SolverPanel(z3=False, second=Sayer(SatResult.SAT)).names == ("second 1.0",)


@pytest.mark.parametrize(
    ("verdicts", "worst"),
    [
        ("", "PROVED"),
        ("PROVED", "PROVED"),
        ("PROVED UNKNOWN", "UNKNOWN"),
        ("UNKNOWN VACUOUS", "VACUOUS"),
        ("VACUOUS REFUTED PROVED", "REFUTED"),
    ],
)
def test_the_worst_verdict_of_a_solver_counts(verdicts: str, worst: str) -> None:
    by_solver = {str(number): Verdict(word) for number, word in enumerate(verdicts.split())}
    assert TheoremObligationResult("it", PROVED, by_solver).verdict is Verdict(worst)


_LAYERS = "aeros.runtime.gate.finite_layers"
MUTANT = Mutant("counts-anything", "counts", _LAYERS, "type(used) is int and used >= 0", "True")


def counts(code: ModuleSource) -> TheoremObligation:
    """The claim that the code counts no text."""
    is_count = code.module(_LAYERS)._is_count("many")
    return TheoremObligation("No text is a count.", [], "false" if is_count else "true")


def theorem(makers: Mapping[str, Callable[[ModuleSource], TheoremObligation]], *mutants: Mutant) -> Theorem:
    return Theorem("Counts are counts.", makers, mutants)


def test_each_obligation_is_announced_and_checked_in_order() -> None:
    reported: list[str] = []
    both = theorem({"counts": counts, "small": lambda _: REFUTED})
    found = check_theorem(both, ModuleSource(), SolverPanel(), reported.append)
    assert [(one.name, one.verdict) for one in found] == [
        ("counts", Verdict.PROVED),
        ("small", Verdict.REFUTED),
    ]
    assert reported == ["counts", "small"]


def test_a_mutant_must_refute_the_obligation_that_it_names() -> None:
    reported: list[str] = []
    harmless = Mutant("harmless", "counts", _LAYERS, "type(used) is int and used >= 0", "type(used) is int")
    found = check_mutants(theorem({"counts": counts}, MUTANT, harmless), SolverPanel(), reported.append)
    assert [(one.mutant.name, one.refuted) for one in found] == [
        ("counts-anything", True),
        ("harmless", False),
    ]
    assert reported == ["counts-anything", "harmless"]


def test_only_a_refuted_obligation_detects_a_mutant() -> None:
    for verdict in Verdict:
        result = TheoremObligationResult("it", PROVED, {"z3": verdict})
        assert MutantResult(MUTANT, result).refuted is (verdict is Verdict.REFUTED)


def test_a_mutant_of_a_module_that_the_obligation_does_not_load_is_an_error() -> None:
    with pytest.raises(InternalError, match=r"`counts` is not made of `aeros\.runtime\.gate\.finite_layers`"):
        check_mutants(theorem({"counts": lambda _: REFUTED}, MUTANT), SolverPanel(), lambda _: None)
