"""Scopes of conditions: where a condition ends, and which request depends on it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Final

from aeros.agent.instructions import english
from aeros.agent.instructions.conditions import find_condition
from aeros.agent.instructions.covering import cover
from aeros.agent.instructions.grammar import check_scopes
from aeros.agent.instructions.lexicon import TaskPhrases
from aeros.agent.instructions.meaning import Errand
from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.requests import read_request
from aeros.agent.instructions.segments import COMMA, Link, Mood, Segment, Sentence
from aeros.agent.instructions.sentences.clauses import segments_of
from aeros.agent.instructions.sentences.run_ons import without_run_ons


def scoped(sentence: Sentence, tasks: Sequence[TaskPhrases], before: Sequence[Errand]) -> Sentence:
    """Find where conditions end, and check that each prohibition and condition has one possible scope.

    Args:
        sentence: segments in the order in which they were said.
        tasks: all tasks.
        before: requests that a pronoun may mean the object of.

    Returns:
        The sentence in the order in which it is to be done. `if it is dirty clean it` is two segments, and
        `if it is dirty, tidy it and wipe it` one condition of one request.

    Raises:
        InstructionError: a scope or an order is not certain.
    """
    sentence = tuple(part for one in sentence for part in _without_comma(one, tasks))
    sentence = _with_new_requests(without_run_ons(sentence, tasks), tasks)
    try:
        return check_scopes(sentence)
    except InstructionError:
        if _is_of_last_alone(sentence, tasks, before):
            return check_scopes((*sentence[:-2], replace(sentence[-2], link=Link.THEN), sentence[-1]))
        joined = _as_one_request(sentence)
        if joined is None:
            raise
        condition, request, *_ = joined
        try:
            read_request(request, condition, tasks, before)
        except InstructionError:
            joined = None
        if joined is None:
            raise
        return check_scopes(joined)


def _with_new_requests(sentence: Sentence, tasks: Sequence[TaskPhrases]) -> Sentence:
    """Mark the request of `skip the teas and wipe the table`: what is skipped is a thing, and no act."""
    marked = list(sentence)
    for at, (before, segment) in enumerate(pairwise(sentence), 1):
        is_of_thing = before.mood is Mood.PROHIBITION and before.marker[0] in _OF_THINGS
        if not is_of_thing or segment.mood is not Mood.REQUEST or english.is_gerund(segment.words[0]):
            continue
        things = [cover(entry, before.words, knows_pronoun=False) for entry in tasks]
        acts = [cover(entry, segment.words, knows_pronoun=False) for entry in tasks]
        if any(one.is_object_alone for one in things) and any(
            one.is_whole and not one.starts_with_object for one in acts
        ):
            marked[at] = replace(segment, is_new=True)
    return tuple(marked)


_OF_THINGS: Final = frozenset({"cancel", "forget", "no", "omit", "skip"})
"""First words of prohibitions of a thing, as in `no teas`."""


def _without_comma(segment: Segment, tasks: Sequence[TaskPhrases]) -> Sentence:
    """Split `if it is dirty clean it` after the longest condition that a task declares."""
    if segment.mood is not Mood.CONDITION or _is_declared(segment, tasks):
        return (segment,)
    for end in range(len(segment.words) - 1, 1, -1):
        condition = replace(segment, words=segment.words[:end])
        if _is_declared(condition, tasks):
            rest = tuple(segments_of(segment.words[end:]))
            polite = (
                replace(one, link=Link.JOINED if at == 0 else one.link, is_polite=segment.is_polite)
                for at, one in enumerate(rest)
            )
            # `…, and if it is dirty wipe it` is of what follows; a comma alone leaves that open.
            is_led = bool(segment.joint.strip(f"{COMMA} "))
            return (replace(condition, link=Link.JOINED) if is_led else condition, *polite)
    return (segment,)


def _is_declared(condition: Segment, tasks: Sequence[TaskPhrases]) -> bool:
    return any(find_condition(condition, entry, is_own=True) is not None for entry in tasks)


def _is_of_last_alone(sentence: Sentence, tasks: Sequence[TaskPhrases], before: Sequence[Errand]) -> bool:
    """Return True for `bring the can and clean the table if it is dirty`: `it` can only be the table."""
    *requests, condition = sentence
    is_of_it = condition.mood is Mood.CONDITION and condition.words[:1] == ("it",)
    if not is_of_it or len(requests) < 2 or any(one.mood is not Mood.REQUEST for one in requests):
        return False
    context = list(before)
    try:
        for request in requests:
            context.append(read_request(request, None, tasks, context).errand)
    except InstructionError:
        return False
    asked = [entry for one in context[len(before) :] for entry in tasks if entry.routed.covers(one.routed)]
    *earlier, last = (find_condition(condition, entry, is_own=True) is not None for entry in asked)
    return last and not any(earlier)


def _as_one_request(sentence: Sentence) -> Sentence | None:
    """Join the requests after a leading condition; None if that is not all that the sentence has."""
    if not sentence or sentence[0].mood is not Mood.CONDITION:
        return None
    requests = sentence[1:]
    is_joined = all(one.mood is Mood.REQUEST and one.link is Link.JOINED for one in requests)
    if len(requests) < 2 or not is_joined:
        return None
    words = tuple(word for one in requests for word in one.words)
    return (sentence[0], replace(requests[0], words=words))
