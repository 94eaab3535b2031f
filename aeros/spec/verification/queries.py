"""What explanations ask the solver, besides the obligations: whether conditions can hold together."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from aeros.spec.backends.oracle import Oracle
from aeros.spec.backends.solver_results import Result
from aeros.spec.expr import terms as t
from aeros.spec.model.model import Declared, about, ranges_of


def impossible(terms: Sequence[t.Term], declared: Iterable[Declared], oracle: Oracle) -> bool:
    """Whether it is proved that no values in range make all `terms` hold; not where the budget runs out.

    declared: every variable of the terms, and others; one without a range may have any value.
    """
    mentioned, whole = about(terms, {one.name: one for one in declared})
    answer = oracle.ask([one.variable for one in mentioned], ranges_of(mentioned), whole)
    return answer.result is Result.UNSAT


def implied(conclusion: t.Term, by: Sequence[t.Term], declared: Iterable[Declared], oracle: Oracle) -> bool:
    """Whether it is proved that `conclusion` holds wherever all of `by` hold."""
    return impossible((*by, t.Not(conclusion)), declared, oracle)
