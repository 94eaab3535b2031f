"""Obligation + budget → verdict: where obligations meet the solver; what explanations ask is `questions`'."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from aeros.spec.backends.oracle import Oracle
from aeros.spec.backends.solver_results import Result
from aeros.spec.diagnostics.codes import Label
from aeros.spec.expr import terms as t
from aeros.spec.model.model import about, ranges_of
from aeros.spec.obligations.obligation import Claim, Obligation
from aeros.spec.obligations.verdicts import Verdict
from aeros.spec.verification.witness import Replay, Witness, witness_of


@dataclass(frozen=True)
class Finding:
    """What became of an obligation.

    witness: for a REFUTED claim about always, a counterexample; for a PROVED claim about sometimes,
        an example; replayed through `semantics.py`.
    reason: why the verdict is UNKNOWN.
    labels: what is at fault, the primary one first; where empty, the obligation's own are to be shown.
    repair: the line to write in place of a refuted envelope, or nothing.
    boundary: of a guarded claim: what has to hold for the gate to allow an action.
    The last three are for `answers` to fill in.
    """

    obligation: Obligation
    verdict: Verdict
    witness: Witness | None = None
    reason: str = ""
    labels: tuple[Label, ...] = ()
    repair: str = ""
    boundary: str = ""

    @property
    def guarded(self) -> bool:
        """Refuted, and left to the gate to decide each time."""
        return self.verdict is Verdict.REFUTED and self.obligation.guard is not None


def discharge(obligations: Iterable[Obligation], oracle: Oracle | None = None) -> list[Finding]:
    """The verdict on each obligation, in order.  UNKNOWN is never a pass.

    A verdict and its witness depend on the obligation and the oracle's budget alone.
    """
    asked = Oracle() if oracle is None else oracle
    replay = Replay()
    return [_discharge(one, asked, replay) for one in obligations]


def _discharge(obligation: Obligation, oracle: Oracle, replay: Replay) -> Finding:
    always = obligation.claim is Claim.ALWAYS
    sought = t.Not(obligation.conclusion) if always else obligation.conclusion
    wanted = (*obligation.space.assumptions, sought)
    declared, terms = about(wanted, obligation.space.by_name)
    shown = always and obligation.guard is None
    asked_for = f"{obligation.id} ({obligation.primary.span.source.path})"
    variables = [one.variable for one in declared]
    answer = oracle.ask(variables, ranges_of(declared), terms, asked_for, shown=shown)
    if answer.result is Result.UNKNOWN:
        return Finding(obligation, Verdict.UNKNOWN, reason=f"{answer.reason} (rlimit {oracle.rlimit})")
    if answer.result is Result.UNSAT:
        return Finding(obligation, Verdict.PROVED if always else obligation.failing)
    witness = witness_of(answer.model, declared, terms, replay, shown=shown)
    if witness is None:
        return Finding(
            obligation, Verdict.UNKNOWN, reason="the solver's witness is irrational and did not replay"
        )
    return Finding(obligation, Verdict.REFUTED if always else Verdict.PROVED, witness)
