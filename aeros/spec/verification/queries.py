"""What explanations ask the solver, besides the obligations: whether conditions can hold together."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from aeros.spec.backends.oracle import Oracle
from aeros.spec.backends.solver_results import SatResult
from aeros.spec.expr import terms as t
from aeros.spec.model.model import Declared, ranges_of, relevant_facts


def is_unsatisfiable(terms: Sequence[t.Term], declared: Iterable[Declared], oracle: Oracle) -> bool:
    """Whether it is proved that no values in range make all `terms` hold; not where the budget runs out.

    declared: every variable of the terms, and others; one without a range may have any value.
    """
    mentioned, whole = relevant_facts(terms, {one.name: one for one in declared})
    answer = oracle.check_sat([one.variable for one in mentioned], ranges_of(mentioned), whole)
    return answer.result is SatResult.UNSAT


def is_implied(
    conclusion: t.Term, assumptions: Sequence[t.Term], declared: Iterable[Declared], oracle: Oracle
) -> bool:
    """Whether it is proved that `conclusion` holds wherever all of `assumptions` hold."""
    return is_unsatisfiable((*assumptions, t.Not(conclusion)), declared, oracle)
