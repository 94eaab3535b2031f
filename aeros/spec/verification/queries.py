"""Queries of explanations to the solver, in addition to the obligations."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from aeros.spec.backends.oracle import Oracle
from aeros.spec.backends.solver_results import SatResult
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
    mentioned, whole = relevant_facts(terms, {one.name: one for one in declared})
    answer = oracle.check_sat([one.variable for one in mentioned], ranges_of(mentioned), whole)
    return answer.result is SatResult.UNSAT


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
