"""Splitting of an instruction into sentences of words and commas."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Final

from aeros.agent.instructions import english
from aeros.agent.instructions.phrases import Words
from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.segments import COLON, COMMA
from aeros.agent.instructions.sentences.clauses import strip_ends, strip_openers
from aeros.spec.diagnostics.codes import quoted
from aeros.spec.diagnostics.words import normalized_words

_SENTENCE_END: Final = re.compile(r"(?:[.;!?:\n\r\u2026]|--+|\s[-\u2013\u2014]\s)+")
_SIGNED_NUMBER: Final = re.compile(r"[-+\u2212\u00b1~<>=/.]\d+|\d+\s?[%/<>=]")
"""A number that means another one than its digits alone."""

_WRITTEN: Final = re.compile(
    r"[`#$|{}\[\]<\\^~]|(?<![-=])>|=(?!>)|[\u00b2\u00b3\u00b9\u2070-\u2089]|//|/\*|&&|\w\("
)
"""Signs of code, markup and quotations, which no speaker says."""

_TIMES: Final = re.compile(r"(?i)(?<!\w)(\d+)\s?[x\u00d7](?!\w)")
"""A number as in an order: `2x dumplings`, which is read as `x2 dumplings`."""

_STARTS_LIST: Final = re.compile(r"(?s)(?:^|\s)\(?(?:1[.)]\s.*\s\(?2[.)]\s|a\)\s.*\s\(?b\)\s)")
_INLINE_NUMBER: Final = re.compile(r"(?:^|(?<=\s))\(?(?:\d[.)]|[a-h]\))\s+")
_LIST_NUMBER: Final = re.compile(r"(?m)^\s*(?:\d+[.)]|[-*\u2022])\s+")


def spoken_sentences(instruction: str) -> Iterator[tuple[Words, bool]]:
    """Split an instruction into sentences.

    Args:
        instruction: words of the user.

    Yields:
        Words and commas of each sentence, and True if it ends with a question mark.

    Raises:
        InstructionError: it holds a number with a sign, a fraction or the like, or a sign of code.
    """
    if signed := _SIGNED_NUMBER.search(instruction):
        raise InstructionError(f"the number {quoted(signed.group())} is not understood")
    if written := _WRITTEN.search(instruction):
        raise InstructionError(f"the sign {quoted(written.group())} is not understood; use words alone")
    rest = _LIST_NUMBER.sub("\n", _TIMES.sub(r"x\1", instruction.replace(" + ", " and ")))
    if _STARTS_LIST.search(instruction):
        rest = _INLINE_NUMBER.sub("\n", rest)
    position = 0
    tokens: list[str] = []
    while position < len(rest):
        end = _SENTENCE_END.search(rest, position)
        text = rest[position : end.start() if end else len(rest)]
        position = end.end() if end else len(rest)
        parts = text.split(COMMA)
        goes_on = False
        for number, part in enumerate(parts, 1):
            spoken = english.respelt(normalized_words(part))
            words = _without_like(tuple(word for word in spoken if word not in english.HESITATIONS))
            is_between = tokens and tokens[-1] != COLON and number < len(parts)
            if is_between and words in english.ASIDES:
                goes_on = tokens[-1] == "you"  # `could you, like, make a tea`
                continue
            if is_between and tokens[-1] in _GOES_ON and words in english.CLOSERS:
                goes_on = True  # `could you, when you have time, make a tea`
                continue
            if words:
                has_pause = tokens and tokens[-1] != COLON and not _ends_in_link(tokens) and not goes_on
                tokens += [*([COMMA] if has_pause else []), *words]
            # `could you, um, make a tea`
            goes_on = bool(tokens and spoken) and not words and tokens[-1] in _GOES_ON
        label = strip_ends(tuple(tokens))
        is_label = label in english.LABELS or (bool(label) and strip_openers(label) in ((), *_FOLLOWING))
        if end and end.group().strip() == COLON and is_label:
            tokens = tokens if tuple(tokens) in _ORDINALS else []
            continue
        if end and end.group().strip() == COLON and position < len(rest):
            tokens += [COLON] if tokens else []
        elif tokens:
            if not (is_label and end and COLON in end.group()):
                yield tuple(tokens), bool(end and "?" in end.group())
            tokens = []


def _without_like(words: Words) -> Words:
    """Leave out the `like` of `so like can you wipe it` and `I need it like now`, which says nothing."""
    return tuple(
        word
        for at, word in enumerate(words)
        if word != "like" or words[at + 1 : at + 2] not in _AFTER_LIKE or words[at - 1 : at] in _BEFORE_LIKE
    )


_AFTER_LIKE: Final = tuple(
    (word,) for word in ("can", "could", "just", "now", "please", "really", "right", "two", "would")
)
_BEFORE_LIKE: Final = tuple(
    (word,)
    for word in (
        "and",
        "d",
        "i",
        "is",
        "it",
        "look",
        "looks",
        "not",
        "or",
        "something",
        "sounds",
        "that",
        "they",
        "to",
        "we",
        "would",
        "you",
    )
)
_GOES_ON: Final = frozenset(
    {"and", "can", "could", "me", "please", "the", "then", "to", "us", "will", "would", "you"}
)
"""Words that a sentence does not end with: a hesitation behind one is no pause."""

_FOLLOWING: Final = (("following",), ("this",), ("these",))
_ORDINALS: Final = (("first",), ("second",), ("third",), ("fourth",), ("next",))
"""Labels that are kept: a thing behind one is asked for, as in `first: a tea.`."""


def with_labelled_values(sentences: Sequence[tuple[Words, bool]]) -> Iterator[tuple[Words, bool]]:
    """Join `destination: left` with the sentence before, whose request it says more about.

    Args:
        sentences: the sentences.

    Yields:
        The sentences; `fetch the can, destination left` for `fetch the can. destination: left`.
    """
    nouns = english.PLACE_NOUNS | english.COUNT_NOUNS
    joined: list[tuple[Words, bool]] = []
    for tokens, is_question in sentences:
        is_value = tokens[:1] and tokens[0] in nouns and tokens[1:2] == (COLON,) and len(tokens) > 2
        if joined and is_value and not is_question and COMMA not in tokens:
            before, was_question = joined.pop()
            joined.append(((*before, COMMA, tokens[0], *tokens[2:]), was_question))
        else:
            joined.append((tokens, is_question))
    yield from joined


def _ends_in_link(tokens: Sequence[str]) -> bool:
    """Return True for `…, and then`, after which a pause parts nothing."""
    return COMMA in tokens and english.SEQUENCE.ending(tuple(tokens)) == tuple(tokens[_last_pause(tokens) :])


def _last_pause(tokens: Sequence[str]) -> int:
    return len(tokens) - tokens[::-1].index(COMMA)
