"""Phrases that the tasks of modules declare, and where they stand in a request.

A task declares by a noun in the plural that it is done for all of a kind: `all the bolts`, `every bolt`. Of
any other task such a word would ask for a number that the task does not do, so it stays unknown, and the
instruction is refused.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Final, TypeAlias

from aeros.agent.instructions import english
from aeros.agent.instructions.arguments import ValuePhrase, counted_parameter, value_phrases
from aeros.agent.instructions.phrases import Words
from aeros.agent.planning.routing import RoutedTask
from aeros.spec.diagnostics.words import expanded, normalized_words
from aeros.spec.model.ecm import Ecm, Task

_ARTICLES: Final = frozenset({"a", "an", "the"})
"""They ask for nothing, so they are free within extras."""

_MAX_EXTRA: Final = 24
"""Number of words that are compared with extras at most."""

_MAX_LISTS: Final = 1 << 8
"""Lists of phrases that are kept with what is made of them: each instruction is read by the same few."""

_MAX_MODULES: Final = 8
"""Sets of modules whose phrases are kept: the active ones and the installed ones."""

_FULL_DETERMINERS: Final = english.DETERMINERS - english.PARTIAL_DETERMINERS


@dataclass(frozen=True, slots=True, eq=False)
class TaskPhrases:
    """A task with its declared phrases as words, longest first.

    Equal to itself alone, so that it is a fast key of caches.

    Attributes:
        routed: the task.
        triggers: phrases that ask for it: verbs, or any words if it declares no objects.
        objects: phrases of what it acts on.
        extras: phrases that may be said with it and change nothing.
        values: phrases for values of its parameters.
        states: adjectives of its conditions that may stand before its object: `the dirty table`.
        particles: particles of its verbs of two words, which may stand apart: `tidy the table up`.
    """

    routed: RoutedTask
    triggers: tuple[Words, ...]
    objects: tuple[Words, ...]
    extras: tuple[Words, ...]
    values: tuple[ValuePhrase, ...] = ()
    states: frozenset[str] = frozenset()
    particles: frozenset[str] = field(init=False, repr=False)
    _indexes: tuple[tuple[tuple[Words, ...], _Index], ...] = field(init=False, repr=False)
    """Triggers, objects and extras, each list with its index."""

    def __post_init__(self) -> None:
        ends = {phrase[-1] for phrase in self.triggers if len(phrase) == 2}
        object.__setattr__(self, "particles", frozenset(ends & english.PARTICLES))
        lists = (self.triggers, self.objects, self.extras)
        object.__setattr__(self, "_indexes", tuple((one, _by_first_word(one)) for one in lists))

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
        if at >= len(words):
            return None
        begins = _declared_words(words[at], is_perfect=is_perfect)
        is_done_once = counted_parameter(self.routed.task) is None
        return next(
            (
                one
                for one in self.values
                if one.words[0] in begins
                and len(one.words) > more_than
                and not (one.is_place and len(one.words) == 1 and _is_verb_at(words, at))
                and not (is_done_once and one.names_object and _is_of_several(one.words, words, at))
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
        for phrases, index in self._indexes:
            is_verb = phrases is self.triggers and bool(self.objects)
            length = 0
            for one in _candidates(index, words[at], is_perfect=is_perfect):
                if len(one) > max(length, found[1]) and _stands_at(
                    one, words, at, is_perfect=is_perfect, is_verb=is_verb
                ):
                    length = len(one)
            if phrases is self.extras:
                length = max(length, _longest_with_articles(index, words, at))
            if length > found[1]:
                found = phrases, length
        return found


_Index: TypeAlias = "Mapping[str, Sequence[Words]]"
"""Phrases by their first word."""


@lru_cache(maxsize=_MAX_LISTS)
def _by_first_word(phrases: tuple[Words, ...]) -> _Index:
    found: dict[str, list[Words]] = {}
    for one in phrases:
        found.setdefault(one[0], []).append(one)
    return found


def _candidates(index: _Index, word: str, *, is_perfect: bool) -> Iterator[Words]:
    """Yield the phrases that may begin with a form of a word."""
    for declared in _declared_words(word, is_perfect=is_perfect):
        yield from index.get(declared, ())


def task_phrases(modules: Mapping[str, Ecm]) -> tuple[TaskPhrases, ...]:
    """Collect the phrases of all tasks.

    Args:
        modules: modules by id.

    Returns:
        One entry for each task; the same ones for the same modules.
    """
    return _collected(_SameModules(tuple(modules.items())))


@dataclass(frozen=True, slots=True, eq=False)
class _SameModules:
    """Modules by id, as a key of a cache: compared by identity, as modules never change and have no hash."""

    modules: tuple[tuple[str, Ecm], ...]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _SameModules) and self._identities == other._identities

    def __hash__(self) -> int:
        return hash(self._identities)

    @property
    def _identities(self) -> tuple[tuple[str, int], ...]:
        return tuple((name, id(module)) for name, module in self.modules)


@lru_cache(maxsize=_MAX_MODULES)
def _collected(same: _SameModules) -> tuple[TaskPhrases, ...]:
    return tuple(
        TaskPhrases(
            RoutedTask(name, task),
            _as_words(_expanded(task.trigger_phrases)),
            _as_words(task.object_phrases),
            _with_bare_nouns(_expanded(task.extra_phrases)),
            value_phrases(task),
            _states(task),
        )
        for name, module in same.modules
        for task in module.tasks.values()
    )


def _states(task: Task) -> frozenset[str]:
    """Return the adjectives of conditions such as `the table is dirty`, but for those that are verbs, too."""
    found: set[str] = set()
    objects = _as_words(task.object_phrases)
    for phrase in _as_words(tuple(task.condition_phrases)):
        subject = tuple(word for word in phrase[:-2] if word not in english.DETERMINERS)
        if phrase[-2:-1] == ("is",) and subject in objects:
            found.add(phrase[-1])
    return frozenset(found) - words_in(_as_words(_expanded(task.trigger_phrases)))


@lru_cache(maxsize=_MAX_LISTS)
def words_in(phrases: tuple[Words, ...]) -> frozenset[str]:
    """Collect the words of some phrases.

    Args:
        phrases: the phrases.

    Returns:
        Each word once.
    """
    return frozenset(word for one in phrases for word in one)


@lru_cache(maxsize=_MAX_LISTS)
def _expanded(patterns: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(phrase for one in patterns for phrase in expanded(one))


@lru_cache(maxsize=_MAX_LISTS)
def _as_words(phrases: tuple[str, ...]) -> tuple[Words, ...]:
    """Return phrases as words, longest first."""
    spoken = (words for one in phrases if (words := normalized_words(one)))
    return tuple(sorted(spoken, key=len, reverse=True))


@lru_cache(maxsize=_MAX_LISTS)
def _with_bare_nouns(extras: tuple[str, ...]) -> tuple[Words, ...]:
    """Return phrases as words, and each of several words without articles, as in telegrams: `to other stand`.

    Longest first.
    """
    phrases = _as_words(extras)
    bare = {tuple(word for word in one if word not in _ARTICLES) for one in phrases if len(one) > 2}
    return tuple(sorted({*phrases, *bare}, key=lambda one: (-len(one), one)))


def _longest_with_articles(index: _Index, words: Words, at: int) -> int:
    """Return the number of words of the longest phrase with free articles in it: `into the two trays`."""
    bare = [place for place in range(at, min(len(words), at + _MAX_EXTRA)) if words[place] not in _ARTICLES]
    if not bare or bare[0] != at or bare[-1] - at + 1 == len(bare):
        return 0
    spoken = tuple(words[place] for place in bare)
    length = max(
        (
            len(one)
            for one in _candidates(index, words[at], is_perfect=False)
            if len(one) > 1 and _stands_at(one, spoken, 0, is_perfect=False, is_verb=False)
        ),
        default=0,
    )
    return bare[length - 1] - at + 1 if length else 0


def _is_of_several(phrase: Words, words: Words, at: int) -> bool:
    """Return True for `cups` where a value is `cup`: one thing, and no more, is what it stands for."""
    last = "".join(words[at + len(phrase) - 1 : at + len(phrase)])
    return english.is_plural(last) and not english.is_plural(phrase[-1])


def _is_verb_at(words: Words, at: int) -> bool:
    """Say if a word that may name a side is a verb: `he left the table dirty`, but `on the left the can`."""
    follows = words[at + 1] if at + 1 < len(words) else ""
    before = words[at - 1] if at > 0 else ""
    articles = english.DETERMINERS | english.POSSESSIVES
    return follows in articles | english.PRONOUNS and before not in articles


def _stands_at(phrase: Words, words: Words, at: int, *, is_perfect: bool, is_verb: bool) -> bool:
    """Compare a declared phrase with words, in any number, and verbs in their -ing form, too.

    In the perfect, verbs may be past participles. A verb with an `s`, as in `he cleans`, asks for nothing.
    """
    if at + len(phrase) > len(words) or (is_verb and words[at] == f"{phrase[0]}s"):
        return False
    for offset, declared in enumerate(phrase):
        if declared not in _declared_words(words[at + offset], is_perfect=is_perfect):
            return False
    return True


@lru_cache(maxsize=1 << 14)
def _declared_words(word: str, *, is_perfect: bool) -> frozenset[str]:
    """Return the words of declared phrases that a spoken word may stand for."""
    found = set(english.base_forms(word))
    if word in english.PRONOUNS:
        found |= {"it", "them"}
    if word in english.DETERMINERS or word in english.POSSESSIVES:
        found.add("the")
    return frozenset(found | english.participle_bases(word) if is_perfect else found)


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
