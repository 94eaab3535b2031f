"""Meaning of one request: the one task whose phrases cover its words, with its arguments."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from aeros.agent.instructions import english
from aeros.agent.instructions.arguments import has_object_of, is_object
from aeros.agent.instructions.conditions import find_condition
from aeros.agent.instructions.coverage import Coverage
from aeros.agent.instructions.covering import cover
from aeros.agent.instructions.lexicon import TaskPhrases
from aeros.agent.instructions.meaning import Errand
from aeros.agent.instructions.phrases import Words
from aeros.agent.instructions.refusals import (
    AmbiguousInstructionError,
    InstructionError,
    ambiguous_tasks,
    not_covered,
)
from aeros.agent.instructions.segments import Link, Segment
from aeros.agent.instructions.wordings.forms import wordings
from aeros.agent.planning.routing import RoutedTask
from aeros.spec.diagnostics.codes import quoted


@dataclass(frozen=True, slots=True)
class Request:
    """Meaning of one request.

    Attributes:
        errand: the task with its arguments, and the condition.
        lacks_place: True if its verb says to put a thing down, and its words do not say where.
        stated: parameters that its words say a value of.
        only_refers: True if a pronoun stands for its object, or its words only name an object, as in
            `…, the blue one`.
        has_verb: True if its words have a verb of their own.
        topic: the task whose object its condition names; None if it names none.
    """

    errand: Errand
    stated: frozenset[str] = frozenset()
    only_refers: bool = False
    has_verb: bool = True
    topic: TaskPhrases | None = None
    lacks_place: bool = False


def read_request(
    segment: Segment,
    condition: Segment | None,
    tasks: Sequence[TaskPhrases],
    before: Sequence[Errand],
    topic: TaskPhrases | None = None,
    *,
    may_elide: bool = False,
) -> Request:
    """Find the one task that covers a request, and the condition on which it is done.

    Args:
        segment: words of the request.
        condition: words of its condition; None for always.
        tasks: all tasks.
        before: requests that a pronoun may mean the object of, the last one first of all.
        topic: task whose object the condition of the request before names, and this one may mean by `it`.
        may_elide: True if its object may be left out, as a statement before has named it.

    Returns:
        The request.

    Raises:
        AmbiguousInstructionError: several tasks cover it, or several values of a parameter are possible.
        InstructionError: it, or its condition, is not understood.
    """
    if condition is None:
        return _read(segment, tasks, before, may_elide=may_elide)
    meanings = [(entry, found) for entry in tasks if (found := find_condition(condition, entry)) is not None]
    if not meanings and topic is not None and condition.words[:1] == ("it",):
        # `if the table is clean, make tea; if it is dirty, …`
        by_topic = find_condition(condition, topic, is_own=True)
        meanings = [] if by_topic is None else [(topic, by_topic)]
    # The condition names an object, so `it` in the request may stand for that.
    context = [*before, *(Errand(entry.routed) for entry, _ in meanings[:1])]
    request = _read(segment, tasks, context, may_elide=bool(meanings))
    routed = request.errand.routed
    asked = next(entry for entry in tasks if entry.routed.covers(routed))
    own = find_condition(condition, asked, is_own=True)
    if own is None and not meanings:
        declared = sorted({phrase for entry in tasks for phrase in entry.routed.task.condition_phrases})
        known = ", ".join(f"`{one}`" for one in declared[:8]) or "none is declared"
        raise InstructionError(f"the condition {quoted(condition.text)} is not understood; known: {known}")
    if own is not None and condition.marker in english.DURATIONS:
        raise InstructionError(
            f"{quoted(condition.text)} may ask to go on for as long; write `if` for a check before it starts"
        )
    # Another task may declare the condition, as in `bring tea if the table is clean`.
    found = own or meanings[0][1]
    if own is None and any(other.term != found.term for _, other in meanings):
        raise InstructionError(f"several tasks declare the condition {quoted(condition.text)}")
    if condition.marker in english.CONCESSIONS:
        return request  # `even if the table is clean`: in any case
    if condition.marker[-1:] == ("unless",):
        found = found.negated
    return replace(
        request,
        errand=Errand(routed, found.term, found.text),
        topic=meanings[0][0] if meanings else None,
    )


def _read(
    segment: Segment, tasks: Sequence[TaskPhrases], before: Sequence[Errand], *, may_elide: bool = False
) -> Request:
    """Find the one task that covers a request; its object may be left out if its condition has named it.

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
    for words in _with_ends(segment):
        # `clean the table, then the can, please` does not wish for the can.
        may_wish = segment.link is Link.START or words[:1] in english.INDEFINITE
        for form in wordings(
            words,
            is_polite=(segment.is_polite and may_wish) or _follows_as_wish(segment),
            is_perfect=segment.is_perfect,
            carried=segment.carried,
        ):
            coverages = [
                cover(
                    entry,
                    form.words,
                    knows_pronoun=last is not None and has_object_of(entry.routed, last),
                    is_perfect=form.is_perfect,
                )
                for entry in tasks
            ]
            whole = [
                one
                for one in coverages
                if (one.is_whole and (one.starts_with_object or not form.needs_object_first))
                or (form.words == words and one.repeats(last))
            ] or [one for one in coverages if one.is_whole_without_verb(is_light=segment.is_light)]
            # `clean the table, then inspect`: of the same table
            is_another = segment.link in (Link.JOINED, Link.THEN)
            is_elided = (may_elide or is_another) and last is not None and not whole
            if is_elided and last is not None:
                named = [one for one in coverages if has_object_of(one.entry.routed, last)]
                whole = [
                    one
                    for one in named
                    if one.is_verb_alone and (may_elide or not one.entry.routed.covers(last))
                ]
            if len(whole) == 1:
                return _with_arguments(segment, whole[0], last, refers=is_elided or whole[0].names_pronoun)
            if whole:
                raise ambiguous_tasks(segment.text, [one.entry.routed for one in whole])
            refusal = refusal or not_covered(segment, coverages)
    assert refusal is not None  # noqa: S101 - the first round makes one
    raise refusal


def _with_ends(segment: Segment) -> Iterator[Words]:
    """Yield the words of a request, then those with its openers or closers.

    The phrase of a task may begin with words that are openers elsewhere, as in `go on`, or end with closers.
    """
    openers, closers = segment.openers, segment.closers
    for number in range(len(openers) + 1):
        yield openers[len(openers) - number :] + segment.words
    for end in range(1, len(closers) + 1):
        yield segment.words + closers[:end]


def _follows_as_wish(segment: Segment) -> bool:
    """Return True for `two teas` of `bring me the can, followed by two teas` or `…, then two teas`.

    `clean the table, then a can` may be about cleaning a can.
    """
    first = segment.words[:1]
    is_number = english.number_of("".join(first)) is not None and first not in english.INDEFINITE
    if segment.link is Link.THEN and is_number:
        return True
    return segment.joint.endswith("followed by") and (is_number or first in english.INDEFINITE)


def _with_arguments(
    segment: Segment, coverage: Coverage, last: RoutedTask | None, *, refers: bool
) -> Request:
    """Return the task with its arguments; if the words refer to it, of the object of the request before.

    Raises:
        AmbiguousInstructionError: an argument may have several values.
        InstructionError: an argument is missing that is a number.
    """
    routed = coverage.routed
    stated = frozenset(coverage.values.stated)
    is_put = any(one[0] in english.PLACING_VERBS for one in coverage.triggers)
    vague = next((word for word in segment.closers if word in ("there", "first" if is_put else "")), "")
    if vague and coverage.puts and not coverage.values.names_place:
        raise InstructionError(f"{quoted(segment.text)} does not say which place {quoted(vague)} is")
    is_same = last is not None and coverage.entry.routed.covers(last)
    has_part = coverage.values.names_part or (last is not None and is_same and not _is_of_whole(last))
    if coverage.names_that_part and not has_part:
        raise InstructionError(f"{quoted(segment.text)} does not say which part; no part was named before")
    parameters = routed.task.parameters
    is_of_things = any(map(is_object, parameters.values())) and not coverage.values.is_specific
    if is_of_things and any(
        english.is_plural(one[-1]) for one in coverage.objects if english.PRONOUNS.isdisjoint(one)
    ):
        raise InstructionError(f"{quoted(segment.text)} does not say which of several things are meant")
    # `bring the cup, then put the object on the left`
    refers = refers or (is_of_things and bool(coverage.objects))
    if last is not None and is_same and refers and not coverage.values.is_specific:
        # `the left half is dirty, so clean it`: `it` is that half, if the words say no other part.
        is_part = (
            not any(map(is_object, parameters.values())) and not stated and segment.link is not Link.THEN
        ) or coverage.names_that_part
        before = {name: one for name, one in last.arguments.items() if is_part or is_object(parameters[name])}
        arguments = routed.task.complete_arguments({**routed.arguments, **before})
        return Request(Errand(replace(routed, arguments=arguments)), stated, only_refers=True)
    for name, values in coverage.values.open_parameters():
        candidates = {
            one: replace(routed, arguments={**routed.arguments, name: one}).instruction for one in values
        }
        listed = ", ".join(f"`{one}`" for one in values)
        parameter = routed.task.parameters[name]
        phrases = {one: ", ".join(parameter.phrases.get(one, ())) for one in values}
        shown = ", ".join(f"`{one}` ({phrases[one]})" for one in values) if any(phrases.values()) else listed
        if not values:
            raise InstructionError(
                f"{quoted(segment.text)} does not say `{name}` of `{routed}`; write "
                f"`aeros run --task {routed} {name}=VALUE`"
            )
        raise AmbiguousInstructionError(
            f"{quoted(segment.text)} leaves open `{name}` of `{routed}`: {shown}", segment.text, candidates
        )
    only_refers = coverage.names_pronoun or not coverage.triggers
    return Request(
        Errand(routed), stated, only_refers, bool(coverage.triggers), lacks_place=coverage.lacks_place
    )


def _is_of_whole(routed: RoutedTask) -> bool:
    """Return True if every argument is the default, so that no part is named."""
    return all(routed.task.parameters[name].default == one for name, one in routed.arguments.items())
