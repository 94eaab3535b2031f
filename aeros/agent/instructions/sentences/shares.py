"""Shares of a number among several: `two teas, one for me and one for Ben`, `a tea for me, one for Mia`."""

from __future__ import annotations

from itertools import takewhile
from typing import Final, NamedTuple

from aeros.agent.instructions import english
from aeros.agent.instructions.phrases import Words
from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.segments import COLON, COMMA
from aeros.agent.instructions.sentences.names import NO_NAMES
from aeros.spec.diagnostics.codes import quoted

_ONE: Final = frozenset({"a", "an", "another", "one"})
_BARE_ONE: Final = frozenset({"another", "one"})
_JOINTS: Final = frozenset({COMMA, "and", "plus", "then"})
_PAUSES: Final = frozenset({COMMA, COLON})
_TOGETHER: Final = ("and", "that", "is", "so")
"""Words between a number and its shares: `two teas, that is, one for me and one for Ben`."""

_MAX_NOUN: Final = 3
_DETERMINERS: Final = english.DETERMINERS | english.POSSESSIVES
_NUMBERS: Final = {2: "two", 3: "three", 4: "four", 5: "five"}
_RECEIVERS: Final = frozenset({"me", "us", "him", "her", "them"})
_ONE_PERSON: Final = frozenset({"me", "him", "her"})
_SEVERAL: Final = frozenset({"children", "company", "everybody", "everyone", "family", "people", "team"})
_NO_RECEIVER: Final = english.BARRED | english.NEGATIVES | english.TO_PLACES | NO_NAMES


class _Share(NamedTuple):
    """One of a kind for somebody.

    Attributes:
        noun: words of the kind; none for `one for me`.
        end: the place after it.
    """

    noun: Words
    end: int


def without_shares(tokens: Words) -> Words:
    """Write what several get as one number.

    Args:
        tokens: words and commas of a sentence.

    Returns:
        `two teas` for `two teas, one for me and one for Ben`, and `two tea for me` for `a tea for me and one
        for Ben` and for `a tea each for me and Ben`.

    Raises:
        InstructionError: the shares are not as many as the number before them.
    """
    tokens = _without_each(tokens)
    for at in range(len(tokens)):
        first = _share_at(tokens, at)
        if first is None:
            continue
        number, end = 1, first.end
        while (following := _next_share(tokens, end)) and following.noun in ((), first.noun):
            number, end = number + 1, following.end
        if number not in _NUMBERS:
            continue
        if first.noun:
            return (*tokens[:at], _NUMBERS[number], *tokens[at + 1 : first.end], *tokens[end:])
        before = tokens[:at]
        while before and before[-1] in (*_PAUSES, *_TOGETHER):
            before = before[:-1]
        numbers = [found for word in before if (found := english.number_of(word)) is not None]
        if numbers[-1:] == [number] and before != tokens[:at]:
            return before + tokens[end:]
        text = " ".join(tokens[at:end]).replace(f" {COMMA}", COMMA)
        raise InstructionError(f"{quoted(text)} are {number} shares, and no such number is said before them")
    return tokens


def _without_each(tokens: Words) -> Words:
    """Write `a tea each for me and Ben` as `a tea for me and one for Ben`."""
    for at in range(2, len(tokens) - 3):
        if tokens[at : at + 2] != ("each", "for"):
            continue
        first = _one_receiver(tokens, at + 2)
        second = _one_receiver(tokens, first + 1) if tokens[first : first + 1] == ("and",) else 0
        if first and second and tokens[second : second + 1] in ((), (COMMA,), ("please",)):
            return (*tokens[:at], *tokens[at + 1 : first + 1], "one", "for", *tokens[first + 1 :])
    return tokens


def _one_receiver(tokens: Words, at: int) -> int:
    """Return the place after the name of one person; 0 if no such words begin at a place."""
    end = at + 1 + (not _DETERMINERS.isdisjoint(tokens[at : at + 1]))
    name = "".join(tokens[end - 1 : end])
    is_name = name in _ONE_PERSON or (name not in _NO_RECEIVER | _RECEIVERS | _SEVERAL and name != "")
    return end if is_name and not english.is_plural(name) else 0


def _share_at(tokens: Words, at: int) -> _Share | None:
    """Return the share that begins at a place: `one for me`, `a tea for me`; also `my brother one`."""
    if tokens[at] in _ONE:
        noun = tuple(
            takewhile(
                lambda word: word not in _JOINTS | _PAUSES | {"for"}, tokens[at + 1 : at + 2 + _MAX_NOUN]
            )
        )
        begin = at + 1 + len(noun)
        is_thing = len(noun) <= _MAX_NOUN and english.POSITIONS.isdisjoint(noun)
        if tokens[begin : begin + 1] == ("for",) and is_thing and (noun or tokens[at] in _BARE_ONE):
            receiver = _receiver(tokens[begin + 1 :])
            return _Share(noun, begin + 1 + receiver) if receiver else None
        if is_thing and noun and tokens[at - 1 : at] and tokens[at - 1] in _RECEIVERS:
            return _Share(noun, begin)  # `me a tea`
    return None


def _next_share(tokens: Words, at: int) -> _Share | None:
    begin = at
    while tokens[begin : begin + 1] and tokens[begin] in _JOINTS:
        begin += 1
    if begin == at or begin >= len(tokens):
        return None
    share = _share_at(tokens, begin)
    if share is None:
        # `a tea for me and my brother one, too`
        person = english.BENEFICIARIES.starting(tokens, begin)
        end = begin + len(person)
        share = _Share((), end + 1) if person and tokens[end : end + 1] == ("one",) else None
    return share


def _receiver(words: Words) -> int:
    """Return the number of words that say who gets a share: `my little brother`."""
    if known := english.BENEFICIARIES.starting(words):
        return len(known)
    # What follows the name is no part of it: `one for Ben tonight`, `one for Ben can wait`.
    length = 1 + (not _DETERMINERS.isdisjoint(words[:1]))
    name = words[length - 1 : length]
    return length if name and name[0] not in _NO_RECEIVER else 0
