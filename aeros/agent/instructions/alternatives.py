"""Conditions that a request before makes true: `if it is dirty, clean it; if it is clean, make tea`."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

from aeros.agent.instructions.meaning import Errand
from aeros.agent.instructions.refusals import InstructionError
from aeros.spec.expr import terms as t


def require_no_alternative(errands: Sequence[Errand]) -> None:
    """Require that no request follows on the opposite of a condition of one that makes the opposite true.

    A condition is measured when its request has its turn. So in `if the table is dirty, clean it; if it is
    clean, make tea`, the tea would be made in either case, although only one of both may be wanted.

    Args:
        errands: the requests in their order.

    Raises:
        InstructionError: there is such a request.
    """
    for first, second in combinations(errands, 2):
        if first.condition is None or second.condition is None:
            continue
        goal = first.routed.task.goal
        conjuncts = goal.operands if isinstance(goal, t.And) else (goal,)
        is_opposite = _negated(first.condition) == second.condition
        if is_opposite and second.condition in conjuncts:
            raise InstructionError(
                f"`{second.condition_text}` is measured after `{first.routed.formal_text}`, which makes it "
                "true; is the second request wanted in either case? say the second one first"
            )


def _negated(condition: t.Term) -> t.Term:
    return condition.operand if isinstance(condition, t.Not) else t.Not(condition)
