"""Merging of segments that are one request: `wipe and tidy the table`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from typing import Final

from aeros.agent.instructions import english
from aeros.agent.instructions.covering import cover
from aeros.agent.instructions.lexicon import TaskPhrases
from aeros.agent.instructions.meaning import Errand
from aeros.agent.instructions.phrases import Words
from aeros.agent.instructions.refusals import AmbiguousInstructionError, InstructionError
from aeros.agent.instructions.requests import read_request
from aeros.agent.instructions.segments import COMMA, Link, Mood, Segment, Sentence

_MAX_MERGES: Final = 6
"""Limit on the joints of a sentence at which segments may be one request: all combinations are tried."""


def merged_requests(sentence: Sentence, tasks: Sequence[TaskPhrases], before: Sequence[Errand]) -> Sentence:
    """Merge segments that are one request: `wipe and tidy the table`, `the table and the bench`.

    The fewest merges are made with which every request is understood; if none is, nothing is merged.

    Args:
        sentence: segments of a sentence.
        tasks: all tasks.
        before: requests that a pronoun may mean the object of.

    Returns:
        The segments, some of them merged.
    """
    joints = [
        at
        for at in range(1, len(sentence))
        if sentence[at].link is Link.JOINED
        and sentence[at].mood is Mood.REQUEST
        and sentence[at - 1].mood is Mood.REQUEST
    ]
    if len(joints) > _MAX_MERGES:
        return sentence
    for choice in sorted(product((False, True), repeat=len(joints)), key=sum):
        merged: list[Segment] = []
        joined = {at for at, is_merged in zip(joints, choice, strict=True) if is_merged}
        for at, segment in enumerate(sentence):
            if at in joined:
                merged[-1] = replace(
                    merged[-1],
                    words=_joined(merged[-1].words, segment, tasks),
                    is_light=merged[-1].is_light or segment.is_light,
                )
            else:
                merged.append(segment)
        if any(_is_another_thing(sentence[at - 1], sentence[at], tasks) for at in joined):
            continue
        context = list(before)
        try:
            for segment in merged:
                if segment.mood is Mood.REQUEST:
                    context.append(read_request(segment, None, tasks, context).errand)
        except AmbiguousInstructionError:
            return sentence
        except InstructionError:
            continue
        return tuple(merged)
    return sentence


def _joined(words: Words, segment: Segment, tasks: Sequence[TaskPhrases]) -> Words:
    """Return the words of both; with `and` between them if a task declares `wrap and boil`."""
    joint = tuple(segment.joint.split())
    for phrase in (one for entry in tasks for one in entry.triggers):
        for at in range(1, len(phrase) - len(joint)):
            is_phrase = phrase[at : at + len(joint)] == joint and words[-at:] == phrase[:at]
            rest = phrase[at + len(joint) :]
            if is_phrase and segment.words[: len(rest)] == rest:
                return words + joint + segment.words
    return words + segment.words


_POINTING: Final = frozenset({"that", "this"})
_LOOSE: Final = english.PRONOUNS | english.PARTICLES | english.FILLERS | {"here", "there"}
"""Words that ask for nothing by themselves."""


def _is_another_thing(first: Segment, segment: Segment, tasks: Sequence[TaskPhrases]) -> bool:
    """Return True if a segment only adds a thing or a number to one that has one: `make a tea and two`."""
    if segment.joint == COMMA and first.words[-1:] and first.words[-1] in _POINTING:
        return True  # `take that, cup`
    if segment.joint not in ("and", "plus", "as well as"):
        return False
    if all(english.number_of(word) is not None for word in segment.words):
        return True
    if any(
        one.triggers and one.values.names_place and not one.objects
        for one in (cover(entry, first.words, knows_pronoun=False) for entry in tasks)
    ) and any(cover(entry, segment.words, knows_pronoun=False).is_whole for entry in tasks):
        return True  # `take a left and bring the cup`
    if _LOOSE.issuperset(segment.words):
        return True  # `bring the cup and them`, `wipe it over and over`
    return any(
        cover(entry, segment.words, knows_pronoun=False).is_object_alone
        and bool(cover(entry, first.words, knows_pronoun=False).objects)
        for entry in tasks
    )
