"""Words for all of a kind, such as `all the bolts` and `every bolt`, where a task is done for all of it.

A task declares that by a noun in the plural. Of any other task such a word would say a number that the task
does not do, so it stays unknown, and the instruction is refused.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from aeros.agent.instructions import english
from aeros.agent.instructions.lexicon import TaskPhrases
from aeros.agent.instructions.phrases import Words

_FULL_DETERMINERS: Final = english.DETERMINERS - english.PARTIAL_DETERMINERS


def plural_objects(entry: TaskPhrases) -> frozenset[Words]:
    """Return the nouns that a task declares in the plural: it is done for all of that kind.

    Args:
        entry: the task.

    Returns:
        The phrases, as declared.
    """
    return frozenset(one for one in entry.objects if english.is_plural(one[-1]))


def singular_objects(entry: TaskPhrases) -> frozenset[Words]:
    """Return the singular of each noun that a task declares in the plural.

    Args:
        entry: the task.

    Returns:
        Phrases that may stand behind `every`; some may be no words of English.
    """
    plurals = plural_objects(entry)
    return frozenset((*one[:-1], form) for one in plurals for form in english.base_forms(one[-1])) - plurals


def universal_noun(entry: TaskPhrases, words: Words, at: int) -> range:
    """Find the noun behind a word for all of a kind.

    Args:
        entry: the task.
        words: words of a request.
        at: place of the word: `all`, `any`, `each` or `every`.

    Returns:
        Places of the noun; empty if there is no such word, or the task is not done for all of a kind.
    """
    if words[at] in ("all", "any"):
        begin = at + 1 + (words[at : at + 2] == ("all", "of"))
        return _noun_at(plural_objects(entry), words, _after_determiners(words, begin))
    if words[at] not in english.EACH_DETERMINERS:
        return range(0)
    begin = at + 1 + (words[at + 1 : at + 2] == ("single",))
    has_one = words[begin : begin + 1] == ("one",)
    begin += has_one
    if words[begin : begin + 1] == ("of",):
        return _noun_at(plural_objects(entry), words, _after_determiners(words, begin + 1))
    return range(0) if has_one else _noun_at(singular_objects(entry), words, begin)


def _after_determiners(words: Words, at: int) -> int:
    while at < len(words) and words[at] in _FULL_DETERMINERS:
        at += 1
    return at


def _noun_at(phrases: Iterable[Words], words: Words, at: int) -> range:
    length = max((len(one) for one in phrases if words[at : at + len(one)] == one), default=0)
    return range(at, at + length) if length else range(0)
