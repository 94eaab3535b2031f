"""Requests for all things that a site lists: `bring both objects`, `bring everything except the cup`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final, NamedTuple

from aeros.agent.instructions import english
from aeros.agent.instructions.arguments import is_object
from aeros.agent.instructions.covering import cover
from aeros.agent.instructions.lexicon import TaskPhrases
from aeros.agent.instructions.phrases import Words
from aeros.agent.instructions.segments import Link, Mood, Segment, Sentence
from aeros.spec.diagnostics.words import normalized_words

_EXCEPT: Final = frozenset({"apart", "aside", "except", "excepting", "excluding"})
_BEFORE_SOME: Final = (("of",), ("half",), ("only",))
_BETWEEN: Final = frozenset({"of", "our", "the", "these", "those", "your"})


class _Things(NamedTuple):
    """Phrase for all things of a task.

    Attributes:
        begin: its first place.
        end: the place after it.
        is_open: True if it names no kind, so that only an exception says what is meant: `everything`.
    """

    begin: int
    end: int
    is_open: bool


def without_sets(sentence: Sentence, tasks: Sequence[TaskPhrases]) -> Sentence:
    """Write a request for all things as one request for each.

    Args:
        sentence: segments of a sentence.
        tasks: all tasks.

    Returns:
        The sentence; with a condition, which would be of the first request alone, it stays as it is.
    """
    if any(segment.mood is Mood.CONDITION for segment in sentence):
        return sentence
    return tuple(
        part
        for at, segment in enumerate(sentence)
        for part in _one_for_each(segment, sentence[at + 1 : at + 2], tasks)
    )


def _one_for_each(segment: Segment, after: Sentence, tasks: Sequence[TaskPhrases]) -> Iterator[Segment]:
    meanings = [
        written
        for entry in tasks
        if segment.mood is Mood.REQUEST and (written := _written_out(segment.words, after, entry))
    ]
    if len(meanings) != 1:
        yield segment
        return
    first, *others = meanings[0]
    yield replace(segment, words=first)
    for words in others:
        yield replace(segment, words=words, link=Link.JOINED, joint="and", is_of_set=True)


def _written_out(words: Words, after: Sentence, entry: TaskPhrases) -> list[Words]:
    """Return the words with the name of each thing in place of all; none if that is not clear."""
    names = _names(entry)
    found = next((one for at in range(len(words)) if (one := _things_at(words, at, len(names)))), None)
    if found is None or len(names) < 2:
        return []
    spared: frozenset[str] = frozenset()
    for spoken in after:
        if spoken.mood is not Mood.PROHIBITION or spoken.link is not Link.ADJUNCT:
            continue
        exception = cover(entry, spoken.words, knows_pronoun=False)
        is_clear = exception.is_object_alone and exception.values.is_specific
        if spoken.marker[0] not in _EXCEPT or not is_clear or exception.values.names_place:
            return []
        spared = frozenset(map(str, exception.values.stated.values()))
    if found.is_open and not spared:
        return []
    return [
        (*words[: found.begin], "the", *name, *words[found.end :])
        for value, name in names.items()
        if value not in spared
    ]


def _names(entry: TaskPhrases) -> dict[str, Words]:
    """Return a phrase for each thing of a task that no other thing has."""
    parameters = [one for one in entry.routed.task.parameters.values() if is_object(one)]
    found: dict[str, Words] = {}
    for value in parameters[0].values if len(parameters) == 1 else ():
        for words in map(normalized_words, parameters[0].phrases.get(value, ())):
            phrase = entry.value_phrase(words, 0)
            if phrase is not None and phrase.words == words and phrase.values == {value}:
                found.setdefault(value, words)
    return found if parameters and len(found) == len(parameters[0].values) else {}


def _things_at(words: Words, at: int, number: int) -> _Things | None:
    """Return the phrase for all things that begins at a place: `both objects`, `all of the items`."""
    if words[at] == "everything" or words[at:] == ("all",):
        return _Things(at, at + 1, True)
    # `bring the objects`; not `one of the objects`
    says_all = words[at] == "all" or (words[at] == "the" and words[at - 1 : at] not in _BEFORE_SOME)
    says_each = words[at] in english.EACH_DETERMINERS
    if not says_all and not says_each and english.number_of(words[at]) != number:
        return None
    noun = at + 1
    while noun < len(words) and words[noun] in _BETWEEN and not says_each:
        noun += 1
    if english.number_of("".join(words[noun : noun + 1])) == number:
        noun += 1
    if not words[noun : noun + 1] or words[noun] not in (english.THING_NOUNS if says_each else _PLURALS):
        return None
    begin = at - 1 if at and words[at - 1] == "the" else at
    return _Things(begin, noun + 1, False)


_PLURALS: Final = frozenset(f"{noun}s" for noun in english.THING_NOUNS)
