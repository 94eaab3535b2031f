"""Checks that a request depends on: `check whether the table is dirty. If so, clean it.`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from aeros.agent.instructions import english
from aeros.agent.instructions.phrases import PhraseSet, Words
from aeros.agent.instructions.segments import COMMA

SpokenSentence = tuple[Words, bool]
"""Words and commas of a sentence, and True if it ends with a question mark."""

CHECK: Final = "?"
"""First token of a sentence with a check that the next one depends on: its condition is measured anyway."""

_IF: Final[Words] = ("if",)
_UNLESS: Final[Words] = ("unless",)
_THEN: Final[Words] = ("then",)


def without_checks(sentences: Sequence[SpokenSentence]) -> Iterator[SpokenSentence]:
    """Write a check and what depends on it as a condition.

    Args:
        sentences: the sentences.

    Yields:
        The sentences; `is the table dirty? if so, clean it` is `if the table is dirty, clean it`, and `check
        if it is dirty, and clean it if so` is that after a sentence with the check, which begins with
        `CHECK`.
    """
    at = 0
    while at < len(sentences):
        tokens, is_question = sentences[at]
        condition = _checked(tokens, is_question=is_question)
        following = sentences[at + 1] if at + 1 < len(sentences) else ((), False)
        affirmed = english.AFFIRMATIONS.starting(following[0])
        denied = after_denial(following[0], 0)
        if condition and (affirmed or denied):
            rest = following[0][denied or len(affirmed) :]
            rest = rest[1:] if rest[:1] == (COMMA,) else rest
            if not is_question:
                yield (CHECK, *_with_questions(tokens)), False
            yield (*(_UNLESS if denied else _IF), *condition, COMMA, *rest), following[1]
            at += 2
            continue
        for part in _without_own_check(tokens):
            yield part, is_question and part[:1] != (CHECK,)
        at += 1


def after_denial(tokens: Words, at: int) -> int:
    """Find the words after `if not`, which needs a comma or `then`: `if not dirty` goes on.

    Args:
        tokens: words and commas of a sentence.
        at: place of the first word.

    Returns:
        The place of the first word after it and its comma; 0 if no such phrase stands there.
    """
    denial = english.DENIALS.starting(tokens, at)
    end = at + len(denial)
    has_comma = tokens[end : end + 1] == (COMMA,)
    if not denial or not (has_comma or denial[-1:] == _THEN):
        return 0
    return end + has_comma


def _checked(tokens: Words, *, is_question: bool) -> Words:
    """Return the condition that a sentence asks about, or asks to check; empty if it does neither."""
    if is_question and tokens[:1] and tokens[0] in english.BE and COMMA not in tokens:
        subject = next((at for at in range(1, len(tokens)) if tokens[at] not in english.DETERMINERS), 1)
        return (*tokens[1 : subject + 1], tokens[0], *tokens[subject + 1 :])
    check, asked = _after(english.CHECKS, tokens)
    return asked if check and COMMA not in asked else ()


def _after(phrases: PhraseSet, tokens: Words) -> tuple[Words, Words]:
    """Return the phrase that follows the openers of a sentence, and the rest; none if there is none."""
    at = 0
    while not (found := phrases.starting(tokens, at)):
        opener = english.OPENERS.starting(tokens, at)
        if not opener:
            return (), tokens
        at += len(opener)
    return found, tokens[at + len(found) :]


def _without_own_check(tokens: Words) -> Iterator[Words]:
    """Part a check from what depends on it in the same sentence."""
    check, rest = _after(english.CHECKS, tokens)
    look, seen = _after(english.LOOKS, _with_questions(tokens))
    asked = _with_questions(tokens)
    if check:
        # `check if the table is dirty and clean it if so`, `check if the table is dirty, if so, clean it`
        for at in range(2, len(rest)):
            link = english.SEQUENCE.starting(rest, at) or rest[at : at + 1]
            link = (
                () if english.AFFIRMATIONS.starting(rest, at)[:1] == _IF else link
            )  # in a transcript without pauses
            if link not in ((), ("and",), (COMMA,), (COMMA, "and")):
                continue
            request = rest[at + len(link) :]
            denied = after_denial(request, 0) or after_denial(rest, at + (rest[at] == COMMA)) - at - len(link)
            affirmed = len(english.AFFIRMATIONS.starting(request))
            if request[:affirmed] == _THEN and english.PRONOUNS.isdisjoint(request):
                continue  # `check if it is dirty, then make tea`: one after the other
            ending = len(english.AFFIRMATIONS.ending(request))
            if denied > 0 or affirmed or ending:
                wanted = request[max(denied, 0) or affirmed :] if not ending else request[:-ending]
                wanted = wanted[1:] if wanted[:1] == (COMMA,) else wanted
                yield (CHECK, *asked[: len(asked) - len(rest) + at])
                yield (*(_UNLESS if denied > 0 else _IF), *rest[:at], COMMA, *wanted)
                return
    elif look:
        # `look at the table and clean it if it is dirty`
        end = next((at for at in range(len(seen)) if seen[at] in ("and", COMMA)), len(seen))
        thing, rest = seen[seen[:1] == ("of",) : end], seen[end + 1 :]  # `do a check of the table and …`
        rest = rest[1:] if rest[:1] in ((COMMA,), ("and",)) else rest
        depends = any(english.CONDITIONALS.starting(rest, at) for at in range(len(rest)))
        it = rest.index("it") if "it" in rest else -1
        # `look at the table and bring the cup if it is dirty` leaves open what is dirty.
        is_clear = it >= 0 and not any(english.CONDITIONALS.starting(rest, at) for at in range(1, it))
        if depends and is_clear and 1 <= len(thing) <= 3:
            yield (CHECK, *asked[: len(asked) - len(seen) + end])
            yield (*rest[:it], *thing, *rest[it + 1 :])
            return
    yield asked


def _with_questions(tokens: Words) -> Words:
    """Write `check if it's dirty`, on which nothing depends, as `check whether it is dirty`."""
    written: list[str] = []
    at = 0
    while at < len(tokens):
        asked = english.ASKS_IF.starting(tokens, at)
        written += (*asked[:-1], "whether") if asked else tokens[at : at + 1]
        at += len(asked) or 1
        if written[-1:] == ["whether"] and tokens[at : at + 2] == ("it", "s"):
            written += ("it", "is")
            at += 2
    return tuple(written)
