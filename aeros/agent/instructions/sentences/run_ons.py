"""Requests that follow each other without a word or a pause between them: `bring the can wipe the table`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

from aeros.agent.instructions import english
from aeros.agent.instructions.covering import cover
from aeros.agent.instructions.lexicon import TaskPhrases
from aeros.agent.instructions.phrases import Words
from aeros.agent.instructions.segments import COMMA, Link, Mood, Segment, Sentence

_MIN_WORDS: Final = 4
_MAX_PARTS: Final = 5

_GOES_ON: Final = (
    english.TO_PLACES
    | english.DETERMINERS
    | english.NEGATIVES
    | english.CHOICES
    | english.TURNS
    | {"and", "by", "for", "from", "of", "that", "which", "who", "with"}
)
"""Words that no request ends with."""


def without_run_ons(sentence: Sentence, tasks: Sequence[TaskPhrases]) -> Sentence:
    """Split run-on requests, as a transcript without punctuation has them.

    Args:
        sentence: the segments of a sentence.
        tasks: all tasks.

    Returns:
        The sentence; a request that no task covers as a whole is split before verbs if there is one way to
        do so in which a task covers each part: its verb, its object and nothing else.
    """
    return tuple(part for segment in sentence for part in _parts(segment, tasks))


def _parts(segment: Segment, tasks: Sequence[TaskPhrases]) -> Sentence:
    if segment.mood is not Mood.REQUEST or len(segment.words) < _MIN_WORDS or _is_whole(segment.words, tasks):
        return (segment,)
    ways = list(_ways(segment.words, tasks, is_first=True))
    if len(ways) != 1 or not 1 < len(ways[0]) <= _MAX_PARTS:
        return (segment,)
    first, *others = ways[0]
    more = (
        Segment(Mood.REQUEST, words, Link.JOINED, joint=COMMA, is_polite=segment.is_polite)
        for words in others
    )
    *earlier, last = replace(segment, words=first, closers=()), *more
    return (*earlier, replace(last, closers=segment.closers))


def _ways(words: Words, tasks: Sequence[TaskPhrases], *, is_first: bool) -> Iterator[tuple[Words, ...]]:
    """Yield the ways to split words into requests, each of which begins with its verb."""
    if _is_request(words, tasks, is_first=is_first):
        yield (words,)
    for at in range(2, len(words) - 1):
        if words[at - 1] not in _GOES_ON and _begins(words, at, tasks):
            part = words[:at]
            if _is_request(part, tasks, is_first=is_first):
                for rest in _ways(words[at:], tasks, is_first=False):
                    yield (part, *rest)


def _begins(words: Words, at: int, tasks: Sequence[TaskPhrases]) -> bool:
    """Return True if a verb of a task begins at a place, in the imperative."""
    return any(
        words[at : at + length] in entry.triggers
        for entry in tasks
        for length in range(1, min(4, len(words) - at) + 1)
    )


def _is_request(words: Words, tasks: Sequence[TaskPhrases], *, is_first: bool) -> bool:
    found = [cover(entry, words, knows_pronoun=not is_first) for entry in tasks]
    whole = [one for one in found if one.is_whole]
    return len(whole) == 1 and _begins(words, 0, tasks)


def _is_whole(words: Words, tasks: Sequence[TaskPhrases]) -> bool:
    return any(cover(entry, words, knows_pronoun=True).is_whole for entry in tasks)
