"""Discharge of obligations: the solver decides each within its budget.

The further queries of explanations are in `queries`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from aeros.spec.backends.oracle import Oracle, PosedQuestion
from aeros.spec.backends.solver_results import Question, SatResult, SolverAnswer
from aeros.spec.diagnostics.codes import Fix, SpanLabel
from aeros.spec.expr import terms as t
from aeros.spec.model.variables import ranges_of, relevant_facts
from aeros.spec.obligations.obligation import ClaimMode, Obligation
from aeros.spec.obligations.verdicts import Verdict
from aeros.spec.verification.witness import TermEvaluator, Witness, witness_from_model


@dataclass(frozen=True)
class ObligationResult:
    """Verdict on an obligation, with what explains it.

    `explain` fills in labels, repair and boundary.

    Attributes:
        obligation: the obligation.
        verdict: the verdict.
        witness: for a REFUTED claim that something always holds, a counterexample; for a PROVED claim that
            something can hold, an example; replayed through `aeros.spec.expr.semantics`.
        reason: reason for the verdict UNKNOWN.
        labels: places at fault, the primary one first; where empty, the obligation's own labels are shown.
        repair: the line to write in place of a refuted condition, or empty.
        fix: the repair as an edit of the file, if that is known.
        boundary: for a runtime-checked claim, the condition under which the gate allows an action.
    """

    obligation: Obligation
    verdict: Verdict
    witness: Witness | None = None
    reason: str = ""
    labels: tuple[SpanLabel, ...] = ()
    repair: str = ""
    fix: Fix | None = None
    boundary: str = ""

    @property
    def is_runtime_checked(self) -> bool:
        """Refuted, and left to the gate to decide each time."""
        return self.verdict is Verdict.REFUTED and self.obligation.runtime_checked_rule is not None


def discharge_obligations(
    obligations: Iterable[Obligation], oracle: Oracle | None = None
) -> list[ObligationResult]:
    """Decide each obligation with the solver.  UNKNOWN is never a pass.

    A verdict and its witness depend on the obligations and the oracle's budget alone.

    Args:
        obligations: the obligations.
        oracle: solver with its budget and store of answers; None for a new one with the default budget.

    Returns:
        The results, in order.
    """
    solver = Oracle() if oracle is None else oracle
    listed = [_Posed(one) for one in obligations]
    answers = solver.check_together([one.question() for one in listed])
    replay = TermEvaluator()
    return [
        _conclude(one, answer, replay, solver.rlimit) for one, answer in zip(listed, answers, strict=True)
    ]


class _Posed:
    """An obligation with the terms of its question, and the variables that they mention."""

    def __init__(self, obligation: Obligation) -> None:
        self.obligation = obligation
        self.is_always = obligation.mode is ClaimMode.ALWAYS
        self.is_shown = self.is_always and obligation.runtime_checked_rule is None
        sought = t.Not(obligation.conclusion) if self.is_always else obligation.conclusion
        required = (*obligation.space.assumptions, sought)
        self.declared, self.terms = relevant_facts(required, obligation.space.by_name)

    def question(self) -> PosedQuestion:
        variables = [one.variable for one in self.declared]
        description = f"{self.obligation.id} ({self.obligation.primary.span.source.path})"
        return PosedQuestion(
            Question(variables, ranges_of(self.declared), self.terms), description, self.is_shown
        )


def _conclude(posed: _Posed, answer: SolverAnswer, replay: TermEvaluator, rlimit: int) -> ObligationResult:
    obligation = posed.obligation
    if answer.result is SatResult.UNKNOWN:
        return ObligationResult(obligation, Verdict.UNKNOWN, reason=f"{answer.reason} (rlimit {rlimit})")
    if answer.result is SatResult.UNSAT:
        return ObligationResult(obligation, Verdict.PROVED if posed.is_always else obligation.failure_verdict)
    witness = witness_from_model(answer.model, posed.declared, posed.terms, replay, shown=posed.is_shown)
    if witness is None:
        return ObligationResult(
            obligation, Verdict.UNKNOWN, reason="the solver's witness is irrational and did not replay"
        )
    return ObligationResult(obligation, Verdict.REFUTED if posed.is_always else Verdict.PROVED, witness)
