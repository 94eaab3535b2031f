"""Comparison of two meanings of one instruction: the grammar's and a language model's.

Two meanings agree if they have as many requests, in the same order, and the same prohibitions, and if the
goals and conditions of their requests are proved equivalent for all values of the vocabulary. In a goal, the
parameters of a task have the values that the request says. If the solver does not decide it, the meanings
do not agree.
"""

from __future__ import annotations

from aeros.agent.instructions.meaning import Errand, Understanding
from aeros.agent.planning.routing import RoutedTask
from aeros.spec.backends.oracle import Oracle
from aeros.spec.expr import terms as t
from aeros.spec.expr.constants import constant_term
from aeros.spec.model.site import Site
from aeros.spec.verification.queries import is_implied


def is_equivalent(one: t.Term, other: t.Term, site: Site, oracle: Oracle) -> bool:
    """Prove that two conditions hold for the same values of the vocabulary.

    Args:
        one: a condition.
        other: another condition.
        site: site whose variables they read, with their ranges.
        oracle: solver with its budget.

    Returns:
        True if it is proved; False also where the budget runs out.
    """
    if one == other:
        return True
    declared = tuple(site.state.values())
    return is_implied(one, (other,), declared, oracle) and is_implied(other, (one,), declared, oracle)


def meanings_agree(grammar: Understanding, model: Understanding, site: Site, oracle: Oracle) -> bool:
    """Prove that two meanings ask for the same.

    Args:
        grammar: meaning by the grammar.
        model: meaning by a language model.
        site: site whose variables their goals and conditions read.
        oracle: solver with its budget.

    Returns:
        True if it is proved.
    """
    if {one.formal_text for one in grammar.prohibited} != {one.formal_text for one in model.prohibited}:
        return False
    if len(grammar.errands) != len(model.errands):
        return False
    return all(
        _ask_the_same(one, other, site, oracle)
        for one, other in zip(grammar.errands, model.errands, strict=True)
    )


def _ask_the_same(one: Errand, other: Errand, site: Site, oracle: Oracle) -> bool:
    if (str(one.routed) == str(other.routed)) and one.routed.arguments != other.routed.arguments:
        return False
    if one.is_otherwise != other.is_otherwise:
        return False
    first, second = (t.TRUE if errand.condition is None else errand.condition for errand in (one, other))
    goal, other_goal = (_under_arguments(errand.routed) for errand in (one, other))
    return is_equivalent(goal, other_goal, site, oracle) and is_equivalent(first, second, site, oracle)


def _under_arguments(routed: RoutedTask) -> t.Term:
    """Return the goal of a task with the values of its parameters: `cooked >= 2` for `cooked >= count`."""
    variables = {one.full_name: one.declared.variable for one in routed.task.parameters.values()}
    return t.substitute(
        routed.task.goal,
        {name: constant_term(value, variables[name].type) for name, value in routed.variables.items()},
    )
