"""Meaning of one request: the one task whose phrases cover its words, with its arguments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from aeros.agent.instructions import english
from aeros.agent.instructions.arguments import is_object
from aeros.agent.instructions.conditions import find_condition
from aeros.agent.instructions.lexicon import Coverage, TaskPhrases
from aeros.agent.instructions.meaning import Errand
from aeros.agent.instructions.refusals import (
    AmbiguousInstructionError,
    InstructionError,
    ambiguous_tasks,
    not_covered,
)
from aeros.agent.instructions.segments import Link, Segment
from aeros.agent.instructions.wordings import wordings
from aeros.agent.planning.routing import RoutedTask
from aeros.spec.diagnostics.codes import quoted
from aeros.spec.expr import terms as t

_INDEFINITE: Final = (("a",), ("an",), ("one",), ("some",))
_MAX_MERGES: Final = 6
"""Limit on the joints of a sentence at which segments may be one request: all combinations are tried."""


def conditional_errand(
    segment: Segment, condition: Segment | None, tasks: Sequence[TaskPhrases], before: Sequence[Errand]
) -> Errand:
    """Find the one task that covers a request, and the condition on which it is done.

    Args:
        segment: words of the request.
        condition: words of its condition; None for always.
        tasks: all tasks.
        before: requests that a pronoun may mean the object of, the last one first of all.

    Returns:
        The request.

    Raises:
        AmbiguousInstructionError: several tasks cover it, or several values of a parameter are possible.
        InstructionError: it, or its condition, is not understood.
    """
    if condition is None:
        return Errand(task_of(segment, tasks, before))
    meanings = [(entry, *found) for entry in tasks if (found := find_condition(condition, entry)) is not None]
    # The condition names an object, so `it` in the request may stand for that.
    context = [*before, *(Errand(entry.routed) for entry, *_ in meanings[:1])]
    routed = task_of(segment, tasks, context)
    asked = next(entry for entry in tasks if entry.routed.covers(routed))
    own = find_condition(condition, asked, is_own=True)
    if own is None and not meanings:
        declared = sorted({phrase for entry in tasks for phrase in entry.routed.task.condition_phrases})
        known = ", ".join(f"`{one}`" for one in declared[:8]) or "none is declared"
        raise InstructionError(f"the condition {quoted(condition.text)} is not understood; known: {known}")
    # Another task may declare the condition, as in `bring tea if the table is clean`.
    term, text = own or meanings[0][1:]
    if own is None and any(other != term for _, other, _ in meanings):
        raise InstructionError(f"several tasks declare the condition {quoted(condition.text)}")
    if condition.marker == ("unless",):
        return Errand(routed, t.Not(term), f"not ({text})")
    return Errand(routed, term, text)


def task_of(segment: Segment, tasks: Sequence[TaskPhrases], before: Sequence[Errand]) -> RoutedTask:
    """Find the one task that covers a request.

    Raises:
        AmbiguousInstructionError: several tasks cover it.
        InstructionError: none does, or it holds a negation or a choice.
    """
    for word in segment.words:
        if word in english.NEGATIVES:
            raise InstructionError(f"the negation {quoted(word)} in {quoted(segment.text)} is not understood")
        if word in english.CHOICES:
            raise InstructionError(f"{quoted(segment.text)} leaves a choice; ask for one thing")
    last = before[-1].routed if before else None
    refusal: InstructionError | None = None
    for number in range(len(segment.openers) + 1):
        # The phrase of a task may begin with words that are openers elsewhere, as in `go on`.
        words = segment.openers[len(segment.openers) - number :] + segment.words
        # `clean the table, then the can, please` does not wish for the can.
        may_wish = segment.link is Link.START or words[:1] in _INDEFINITE
        is_polite = segment.is_polite and may_wish
        for variant in wordings(words, is_polite=is_polite, is_perfect=segment.is_perfect):
            coverages = [
                entry.cover(
                    variant.words,
                    knows_pronoun=last is not None and entry.routed.covers(last),
                    is_perfect=variant.is_perfect,
                )
                for entry in tasks
            ]
            whole = [
                one
                for one in coverages
                if (one.is_whole and (one.starts_with_object or not variant.needs_object_first))
                or one.repeats(last)
            ]
            if len(whole) == 1:
                return _with_arguments(segment, whole[0], last)
            if whole:
                raise ambiguous_tasks(segment.text, [one.entry.routed for one in whole])
            refusal = refusal or not_covered(segment, coverages)
    assert refusal is not None  # noqa: S101 - the first round makes one
    raise refusal


def _with_arguments(segment: Segment, coverage: Coverage, last: RoutedTask | None) -> RoutedTask:
    """Return the task with its arguments; a pronoun stands for the object of the request before.

    Raises:
        AmbiguousInstructionError: an argument may have several values.
        InstructionError: an argument is missing that is a number.
    """
    routed = coverage.routed
    if last is not None and coverage.names_pronoun and not coverage.values.is_specific:
        before = {
            name: one for name, one in last.arguments.items() if is_object(routed.task.parameters[name])
        }
        arguments = routed.task.complete_arguments({**routed.arguments, **before})
        return replace(routed, arguments=arguments)
    for name, values in coverage.values.open_parameters():
        candidates = {
            one: replace(routed, arguments={**routed.arguments, name: one}).instruction for one in values
        }
        listed = ", ".join(f"`{one}`" for one in values)
        parameter = routed.task.parameters[name]
        stated = {one: ", ".join(parameter.phrases.get(one, ())) for one in values}
        shown = ", ".join(f"`{one}` ({stated[one]})" for one in values) if any(stated.values()) else listed
        if not values:
            raise InstructionError(
                f"{quoted(segment.text)} does not say `{name}` of `{routed}`; write "
                f"`aeros run --task {routed} {name}=VALUE`"
            )
        raise AmbiguousInstructionError(
            f"{quoted(segment.text)} leaves open `{name}` of `{routed}`: {shown}", segment.text, candidates
        )
    return routed
