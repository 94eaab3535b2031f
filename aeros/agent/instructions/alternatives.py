"""Requests on opposite conditions: `…, otherwise …`, and conditions that a request before makes true."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, pairwise

from aeros.agent.instructions import english
from aeros.agent.instructions.lexicon import TaskPhrases
from aeros.agent.instructions.meaning import Errand
from aeros.agent.instructions.prohibitions import is_universal, prohibited_tasks
from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.requests import Request, read_request
from aeros.agent.instructions.segments import Mood, Segment, Sentence
from aeros.spec.diagnostics.codes import quoted
from aeros.spec.expr import terms as t


def read_otherwise(
    sentence: Sentence, first: Request | None, tasks: Sequence[TaskPhrases], before: Sequence[Errand]
) -> Errand | None:
    """Read the request after `otherwise`.

    A pronoun in it may stand for the object that the condition names; if it names none, for that of the first
    branch.

    Args:
        sentence: segments after `otherwise`.
        first: the request before, if it is the only one with its condition; else None.
        tasks: all tasks.
        before: requests that a pronoun may mean the object of.

    Returns:
        The request; None for `otherwise do nothing`.

    Raises:
        InstructionError: there is no condition before, or there is more than one request after `otherwise`.
    """
    segment = sentence[0]
    if first is None or first.errand.condition is None or first.errand.is_otherwise:
        raise InstructionError(
            f"`otherwise` before {quoted(segment.text)} has no single request with a condition before it; "
            "write `if CONDITION, REQUEST, otherwise REQUEST`"
        )
    if any(one.mood is Mood.CONDITION for one in sentence):
        raise InstructionError(
            f"a condition after `otherwise` is not understood: {quoted(segment.text)}; say it in an "
            "instruction of its own"
        )
    if segment.marker + segment.words in english.NOTHINGS and len(sentence) == 1:
        return None
    if len(sentence) > 1:
        raise InstructionError(
            f"is {quoted(sentence[1].text)} wanted only otherwise, or in either case? write one request "
            "after `otherwise`, and what is wanted in either case in a sentence of its own"
        )
    named = [] if first.topic is None else [Errand(first.topic.routed)]
    context = [*before, first.errand, *named]
    if segment.mood is Mood.PROHIBITION:
        if is_universal(segment) or _is_left_out(segment, first.errand, tasks, context):
            return None
        raise InstructionError(f"a prohibition with a condition is not understood: {quoted(segment.text)}")
    return first.errand.otherwise(read_request(segment, None, tasks, context).errand.routed)


def read_unless(
    sentence: Sentence, other: Sentence, tasks: Sequence[TaskPhrases], before: Sequence[Errand]
) -> Errand | None:
    """Read `if the table is clean, do nothing, otherwise wipe it`: a request on the opposite condition.

    Args:
        sentence: segments before `otherwise`.
        other: segments after `otherwise`.
        tasks: all tasks.
        before: requests that a pronoun may mean the object of.

    Returns:
        The request; None if the sentences do not have this form.

    Raises:
        InstructionError: they have it, and the request or the condition is not understood.
    """
    conditions = [one for one in sentence if one.mood is Mood.CONDITION]
    idle = [one for one in sentence if one.mood is Mood.PROHIBITION or one.words in english.NOTHINGS]
    if len(sentence) != 2 or not (conditions and idle):
        return None
    if len(other) != 1 or other[0].mood is not Mood.REQUEST:
        return None
    (prohibition,) = idle
    is_plain = prohibition.words in english.NOTHINGS or is_universal(prohibition)
    named = [] if is_plain else [Errand(one) for one in prohibited_tasks(prohibition, tasks, before)[:1]]
    wanted = read_request(other[0], conditions[0], tasks, [*before, *named]).errand
    if not is_plain and not _is_left_out(prohibition, wanted, tasks, [*before, wanted]):
        return None
    opposite = wanted.otherwise(wanted.routed)
    return Errand(opposite.routed, opposite.condition, opposite.condition_text)


def require_no_alternative(errands: Sequence[Errand]) -> None:
    """Require that no request follows on the opposite of a condition of one that makes the opposite true.

    A condition is measured when its request has its turn. So in `if the table is dirty, clean it; if it is
    clean, make tea`, the tea would be made in either case, although only one of both may be wanted. After
    `otherwise` nothing is measured again.

    Args:
        errands: the requests in their order.

    Raises:
        InstructionError: there is such a request.
    """
    decided_together = {second for second, (_, one) in enumerate(pairwise(errands), 1) if one.is_otherwise}
    for (_, first), (place, second) in combinations(enumerate(errands), 2):
        if first.condition is None or second.condition is None or place in decided_together:
            continue
        goal = first.routed.task.goal
        conjuncts = goal.operands if isinstance(goal, t.And) else (goal,)
        is_opposite = _negated(first.condition) == second.condition
        if is_opposite and second.condition in conjuncts:
            raise InstructionError(
                f"`{second.condition_text}` is measured after `{first.routed.formal_text}`, which makes it "
                "true; is the second request wanted in either case? say the second one first, or `otherwise` "
                "if only one of both is wanted"
            )


def _is_left_out(
    prohibition: Segment, asked: Errand, tasks: Sequence[TaskPhrases], before: Sequence[Errand]
) -> bool:
    """Return True if a prohibition is of nothing but the task of a request."""
    prohibited = prohibited_tasks(prohibition, tasks, before)
    return all(one.covers(asked.routed) for one in prohibited)


def _negated(condition: t.Term) -> t.Term:
    return condition.operand if isinstance(condition, t.Not) else t.Not(condition)
