"""Obligation + budget → verdict: the only place where install-time questions meet the solver."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from aeros.spec.backends.budget import DEFAULT_RLIMIT
from aeros.spec.expr import terms as t
from aeros.spec.model import Declared, ranges_of
from aeros.spec.obligations.obligation import Claim, Obligation, Space, Verdict
from aeros.spec.witness import Witness, witness_of


@dataclass(frozen=True)
class Finding:
    """What became of an obligation.

    witness: for a REFUTED claim about always, a counterexample; for a PROVED claim about sometimes,
        an example; replayed through `semantics.py`.
    reason: why the verdict is UNKNOWN.
    """

    obligation: Obligation
    verdict: Verdict
    witness: Witness | None = None
    reason: str = ""

    @property
    def guarded(self) -> bool:
        """Refuted, and left to the gate to decide each time."""
        return self.verdict is Verdict.REFUTED and self.obligation.guard is not None


def discharge(obligations: Iterable[Obligation], rlimit: int = DEFAULT_RLIMIT) -> list[Finding]:
    """The verdict on each obligation, in order.  UNKNOWN is never a pass.

    Verdicts and witnesses depend on these obligations and this budget alone: the solver's context is new.
    """
    # z3 takes 80 ms to import, which a command that proves nothing need not pay.
    from aeros.spec.backends.smt import fresh_context

    context = fresh_context()
    return [_discharge(one, rlimit, context) for one in obligations]


def _discharge(obligation: Obligation, rlimit: int, context: Any) -> Finding:
    from aeros.spec.backends.smt import Result, Session

    always = obligation.claim is Claim.ALWAYS
    sought = t.Not(obligation.conclusion) if always else obligation.conclusion
    wanted = (*obligation.space.assumptions, sought)
    declared = _mentioned(obligation.space, wanted)
    session = Session((one.variable for one in declared), ranges_of(declared), rlimit, context)
    answer = session.ask(*wanted)
    if answer.result is Result.UNKNOWN:
        return Finding(obligation, Verdict.UNKNOWN, reason=f"{answer.reason} (rlimit {rlimit})")
    if answer.result is Result.UNSAT:
        return Finding(obligation, Verdict.PROVED if always else obligation.failing)
    witness = witness_of(answer.model, declared, wanted, shown=always and obligation.guard is None)
    if witness is None:
        return Finding(
            obligation, Verdict.UNKNOWN, reason="the solver's witness is irrational and did not replay"
        )
    return Finding(obligation, Verdict.REFUTED if always else Verdict.PROVED, witness)


def _mentioned(space: Space, wanted: tuple[t.Term, ...]) -> tuple[Declared, ...]:
    """The variables of `space` that the question depends on: all others are free to be anything."""
    names = {name for term in wanted for name in t.variables_of(term)}
    return tuple(one for one in space.declared if one.name in names)
