"""Wordings that ask for the same as a plain imperative: `have the table cleaned` is `clean the table`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from aeros.agent.instructions import english
from aeros.agent.instructions.phrases import PhraseSet, Words

_WANT: Words = ("i", "want")
_GIVE: Final = (("give",), ("giving",))


@dataclass(frozen=True, slots=True)
class Wording:
    """Words of a request in one of the forms that it may be read in.

    Attributes:
        words: the words to cover.
        is_perfect: True if its verb may be a past participle.
        needs_object_first: True if the object has to come before the verb, as in `the table cleaned`.
    """

    words: Words
    is_perfect: bool = False
    needs_object_first: bool = False


def wordings(words: Words, *, is_polite: bool, is_perfect: bool) -> Iterator[Wording]:
    """Yield the forms that a request may be read in; the first that a task covers counts.

    Args:
        words: words of the request.
        is_polite: True if `please` is said with it.
        is_perfect: True if its verb is in the perfect or the past.

    Yields:
        The words as they are, with a particle beside its verb, then without the words of a causative, a duty,
        a light verb or a wish.
    """
    yield Wording(words, is_perfect=is_perfect)
    for at in range(2, len(words)):
        if words[at] in english.PARTICLES:
            # `pick me up a book`
            yield Wording((words[0], words[at], *words[1:at], *words[at + 1 :]), is_perfect=is_perfect)
    if is_perfect:
        for linked in _without_each(words, english.COPULAS):
            yield Wording(linked, is_perfect=True, needs_object_first=True)
    if words and words[0] in english.INTENSIFIERS:
        # `do a quick wipe of the table`
        yield Wording(words[1:])
    yield from _causatives(words)
    yield from _duties(words)
    if words[:1] in _GIVE:
        # `give the table a good wipe`
        act = tuple(word for word in words[1:] if word not in english.INTENSIFIERS)
        yield Wording(act, needs_object_first=True)
    if wish := english.WISHES.starting(words):
        yield Wording(_WANT + words[len(wish) :])
    if end := english.WISH_ENDS.ending(words):
        yield Wording(_WANT + words[: -len(end)])
        yield Wording(words[: -len(end)])
    if is_polite:
        # `two teas, please`
        yield Wording(_WANT + words)


def _causatives(words: Words) -> Iterator[Wording]:
    """Yield `the table cleaned` for `have the table cleaned`, `the table clean` for `make … clean`."""
    causative = english.CAUSATIVES.starting(words)
    if not causative:
        return
    rest = words[len(causative) :]
    for linked in (rest, *_without_each(rest, english.COPULAS)):
        if any(english.participle_bases(word) for word in linked):
            yield Wording(linked, is_perfect=True, needs_object_first=True)
        if any(word.endswith("ing") for word in linked):
            yield Wording(linked, needs_object_first=True)
        if linked and linked[-1] in english.ADJECTIVES:
            yield Wording(linked, needs_object_first=True)


def _duties(words: Words) -> Iterator[Wording]:
    """Yield `the table wiped` for `the table should be wiped`."""
    for rest in _without_each(words, english.DUTIES):
        yield Wording(rest, is_perfect=True, needs_object_first=True)


def _without_each(words: Words, phrases: PhraseSet) -> Iterator[Words]:
    """Yield the words without a phrase that stands among them, for each place but the first."""
    for at in range(1, len(words)):
        if found := phrases.starting(words, at):
            yield words[:at] + words[at + len(found) :]
