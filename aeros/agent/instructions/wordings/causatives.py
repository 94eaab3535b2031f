"""Causatives and duties: `have the table cleaned`, `the table needs a wipe`, `i want a clean table`."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from aeros.agent.instructions import english
from aeros.agent.instructions.phrases import Words
from aeros.agent.instructions.wordings.wording import WANT, Wording, without_each

_OF_STATES: Final = frozenset({"let", "make", "see"})
"""Last words of causatives that ask for a state only: `make the can move` and `see the can` do not."""

_ENSURING: Final = frozenset({"certain", "ensure", "see", "sure", "that"})
_WANTING: Final = frozenset({"have", "i", "we"})
_PAST: Final = frozenset({"was", "were"})
_NO_STATES: Final = frozenset({"that", "was", "which"})
"""Words with which a place is where a thing is already: `get the can that is on the left`."""


def causatives(wording: Wording) -> Iterator[Wording]:
    """Read `have the table cleaned` and `make the table clean` as `the table cleaned`, `the table clean`.

    Args:
        wording: words of a request.

    Yields:
        The other forms.
    """
    causative = english.CAUSATIVES.starting(wording.words)
    if not causative:
        return
    rest = wording.words[len(causative) :]
    if causative[-1] in _ENSURING and not _PAST.isdisjoint(rest):
        return  # `make sure the table was cleaned` may ask to check it
    if (
        causative[0] not in _WANTING
        and rest[:1]
        and rest[0] in english.ADJECTIVES
        and rest[1:2]
        and rest[1] in english.DETERMINERS
    ):
        rest = (*rest[1:], rest[0])  # `make clean the table`
    says_done = rest[-1:] == ("done",) and not english.BE.isdisjoint(rest)
    is_statement = causative[-1] not in _ENSURING and says_done  # `make two teas is done`
    for linked in () if is_statement else (rest, *without_each(rest, english.COPULAS)):
        if any(english.participle_bases(word) for word in linked):
            yield wording.with_object_first(linked, is_perfect=True)
        is_state = linked[-1:] and (linked[-1] in english.ADJECTIVES or "for" in linked)
        if causative[-1] not in _OF_STATES or is_state:
            yield wording.with_object_first(linked)
        if causative[-1] == "if" and linked != rest:
            yield wording.with_words((*WANT, *linked))  # `it would be nice if the can were on the left`
        if linked != rest and _NO_STATES.isdisjoint(rest):
            yield from _placed(wording, linked)
    for act in without_each(rest, english.RECEIPTS):
        # `see that the table gets a wipe`
        yield wording.with_object_first(act)
    adjective = next((word for word in rest if word not in english.DETERMINERS), "")
    if causative[0] in ("i", "we", "ensure") and adjective in english.ADJECTIVES:
        # `i want a clean table`
        yield wording.with_words(rest)


def duties(wording: Wording) -> Iterator[Wording]:
    """Read `the table should be wiped` as `the table wiped`.

    Args:
        wording: words of a request.

    Yields:
        The other forms.
    """
    for rest in without_each(wording.words, english.DUTIES):
        yield wording.with_object_first(rest, is_perfect=True)
    words = wording.words
    for at in range(1, len(words)):
        if move := english.MOVES.starting(words, at):
            rest = words[at + len(move) :]
            if move[-1] != "be":
                yield wording.with_words((*words[:at], *rest))
            yield from _placed(wording, (*words[:at], *rest))


def _placed(wording: Wording, words: Words) -> Iterator[Wording]:
    """Read `the can on the left side`, of a state that is wanted, as `the can to the left side`."""
    place = next((at for at, word in enumerate(words) if word in english.POSITIONS), 0)
    if place:
        yield wording.with_words((*words[:place], "to", *words[place + 1 :]))


def passives(wording: Wording) -> Iterator[Wording]:
    """Read `after the table is wiped` as `after the table wiped`.

    Args:
        wording: words of a request.

    Yields:
        The other forms.
    """
    if wording.is_perfect and not wording.needs_object_first:
        for linked in without_each(wording.words, english.COPULAS):
            yield wording.with_object_first(linked)
