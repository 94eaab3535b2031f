"""Queries of explanations to the solver, in addition to the obligations."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from aeros.spec.backends.oracle import Oracle, PosedQuestion
from aeros.spec.backends.solver_results import Question, SatResult
from aeros.spec.expr import terms as t
from aeros.spec.model.variables import Declared, ranges_of, relevant_facts


def is_unsatisfiable(terms: Sequence[t.Term], declared: Iterable[Declared], oracle: Oracle) -> bool:
    """Tell whether it is proved that no values in range make all terms hold.

    Args:
        terms: conditions.
        declared: every variable of the terms, and others; one without a range may have any value.
        oracle: solver with its budget.

    Returns:
        True if it is proved; False also where the budget runs out.
    """
    return oracle.check_sat(*_question(terms, declared)).result is SatResult.UNSAT


def are_unsatisfiable(
    asked: Iterable[tuple[Sequence[t.Term], Iterable[Declared]]], oracle: Oracle
) -> list[bool]:
    """Tell for each of several lists of terms whether it is proved that no values make all of them hold.

    Args:
        asked: lists of conditions, each with every variable of its terms, and others.
        oracle: solver with its budget.

    Returns:
        For each list True if it is proved; False also where the budget runs out.
    """
    posed = [PosedQuestion(_question(terms, declared)) for terms, declared in asked]
    return [answer.result is SatResult.UNSAT for answer in oracle.check_together(posed)]


def is_implied(
    conclusion: t.Term, assumptions: Sequence[t.Term], declared: Iterable[Declared], oracle: Oracle
) -> bool:
    """Tell whether it is proved that a conclusion holds wherever all assumptions hold.

    Args:
        conclusion: the conclusion.
        assumptions: the assumptions.
        declared: every variable of the terms, and others; one without a range may have any value.
        oracle: solver with its budget.

    Returns:
        True if it is proved; False also where the budget runs out.
    """
    return is_unsatisfiable((*assumptions, t.Not(conclusion)), declared, oracle)


def _question(terms: Sequence[t.Term], declared: Iterable[Declared]) -> Question:
    mentioned, whole = relevant_facts(terms, {one.name: one for one in declared})
    return Question([one.variable for one in mentioned], ranges_of(mentioned), whole)
