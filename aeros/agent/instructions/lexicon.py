"""Phrases that the tasks of modules declare, and where they stand in a request.

A task declares by a noun in the plural that it is done for all of a kind: `all the bolts`, `every bolt`. Of
any other task such a word would ask for a number that the task does not do, so it stays unknown, and the
instruction is refused.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

from aeros.agent.instructions import english
from aeros.agent.instructions.arguments import ValuePhrase, value_phrases
from aeros.agent.instructions.phrases import Words
from aeros.agent.planning.routing import RoutedTask
from aeros.spec.diagnostics.words import expanded, normalized_words
from aeros.spec.model.ecm import Ecm, Task

_ARTICLES: Final = frozenset({"a", "an", "the"})
"""They ask for nothing, so they are free within extras."""

_MAX_EXTRA: Final = 24
"""Number of words that are compared with extras at most."""


_FULL_DETERMINERS: Final = english.DETERMINERS - english.PARTIAL_DETERMINERS


@dataclass(frozen=True, slots=True)
class TaskPhrases:
    """A task with its declared phrases as words, longest first.

    Attributes:
        routed: the task.
        triggers: phrases that ask for it: verbs, or any words if it declares no objects.
        objects: phrases of what it acts on.
        extras: phrases that may be said with it and change nothing.
        values: phrases for values of its parameters.
        states: adjectives of its conditions that may stand before its object: `the dirty table`.
    """

    routed: RoutedTask
    triggers: tuple[Words, ...]
    objects: tuple[Words, ...]
    extras: tuple[Words, ...]
    values: tuple[ValuePhrase, ...] = ()
    states: frozenset[str] = frozenset()

    def value_phrase(
        self, words: Words, at: int, *, more_than: int = 0, is_perfect: bool = False
    ) -> ValuePhrase | None:
        """Return the longest phrase for a value at a place, if it has more words than that.

        Args:
            words: words of a request.
            at: the place.
            more_than: words that it must have more of.
            is_perfect: True if verbs may be past participles.

        Returns:
            The phrase; None if there is none.
        """
        return next(
            (
                one
                for one in self.values
                if len(one.words) > more_than
                and _stands_at(one.words, words, at, is_perfect=is_perfect, is_verb=False)
            ),
            None,
        )

    def longest(self, words: Words, at: int, *, is_perfect: bool = False) -> tuple[tuple[Words, ...], int]:
        """Find the longest declared phrase at a place.

        Args:
            words: words of a request.
            at: the place.
            is_perfect: True if verbs may be past participles.

        Returns:
            The list that it is in, and its length; 0 if there is none.
        """
        found: tuple[tuple[Words, ...], int] = ((), 0)
        if at >= len(words):
            return found
        for phrases in (self.triggers, self.objects, self.extras):
            is_verb = phrases is self.triggers and bool(self.objects)
            length = 0
            for one in phrases:
                if len(one) <= found[1]:
                    break
                if _stands_at(one, words, at, is_perfect=is_perfect, is_verb=is_verb):
                    length = len(one)
                    break
            if phrases is self.extras:
                length = max(length, _longest_with_articles(phrases, words, at))
            if length > found[1]:
                found = phrases, length
        return found


def task_phrases(modules: Mapping[str, Ecm]) -> tuple[TaskPhrases, ...]:
    """Collect the phrases of all tasks.

    Args:
        modules: modules by id.

    Returns:
        One entry for each task.
    """
    return tuple(
        TaskPhrases(
            RoutedTask(name, task),
            _as_words(_expanded(task.trigger_phrases)),
            _as_words(task.object_phrases),
            _with_bare_nouns(_as_words(_expanded(task.extra_phrases))),
            value_phrases(task),
            _states(task),
        )
        for name, module in modules.items()
        for task in module.tasks.values()
    )


def _states(task: Task) -> frozenset[str]:
    """Return the adjectives of conditions such as `the table is dirty`, but for those that are verbs, too."""
    found: set[str] = set()
    for phrase in _as_words(tuple(task.condition_phrases)):
        subject = tuple(word for word in phrase[:-2] if word not in english.DETERMINERS)
        if phrase[-2:-1] == ("is",) and subject in _as_words(task.object_phrases):
            found.add(phrase[-1])
    verbs = {word for one in _expanded(task.trigger_phrases) for word in normalized_words(one)}
    return frozenset(found - verbs)


def _expanded(patterns: Sequence[str]) -> list[str]:
    return [phrase for one in patterns for phrase in expanded(one)]


def _as_words(phrases: Sequence[str]) -> tuple[Words, ...]:
    spoken = (words for one in phrases if (words := normalized_words(one)))
    return tuple(sorted(spoken, key=len, reverse=True))


def _with_bare_nouns(phrases: Sequence[Words]) -> tuple[Words, ...]:
    """Add each phrase of several words without articles, as in telegrams: `to other stand`."""
    bare = {tuple(word for word in one if word not in _ARTICLES) for one in phrases if len(one) > 2}
    return tuple(sorted({*phrases, *bare}, key=lambda one: (-len(one), one)))


def _longest_with_articles(phrases: Sequence[Words], words: Words, at: int) -> int:
    """Return the number of words of the longest phrase with free articles in it: `into the two trays`."""
    bare = [place for place in range(at, min(len(words), at + _MAX_EXTRA)) if words[place] not in _ARTICLES]
    if not bare or bare[0] != at or bare[-1] - at + 1 == len(bare):
        return 0
    spoken = tuple(words[place] for place in bare)
    found = next(
        (
            one
            for one in phrases
            if len(one) > 1 and _stands_at(one, spoken, 0, is_perfect=False, is_verb=False)
        ),
        (),
    )
    return bare[len(found) - 1] - at + 1 if found else 0


def _stands_at(phrase: Words, words: Words, at: int, *, is_perfect: bool, is_verb: bool) -> bool:
    """Compare a declared phrase with words, in any number, and verbs in their -ing form, too.

    In the perfect, verbs may be past participles. A verb with an `s`, as in `he cleans`, asks for nothing.
    """
    if at + len(phrase) > len(words) or (is_verb and words[at] == f"{phrase[0]}s"):
        return False
    for offset, declared in enumerate(phrase):
        if not _is_form(declared, words[at + offset], is_perfect=is_perfect):
            return False
    return True


@lru_cache(maxsize=1 << 14)
def _is_form(declared: str, word: str, *, is_perfect: bool) -> bool:
    return (
        declared == word
        or declared in english.base_forms(word)
        or (declared in ("it", "them") and word in english.PRONOUNS)
        or (declared == "the" and word in english.DETERMINERS | english.POSSESSIVES)
        or (is_perfect and declared in english.participle_bases(word))
    )


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
