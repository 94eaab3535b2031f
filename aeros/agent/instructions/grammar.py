"""Grammar of instructions: sentences, and in them requests, prohibitions and conditions.

    instruction  = sentence { ("." | ";" | "!" | "?" | ":" | line end) sentence }
    sentence     = segment { link segment }
    segment      = [openers] (words | prohibition words | conditional words) [closers]
    link         = "," | SEQUENCE | REVERSED, or nothing before a prohibition or a conditional

The words of a segment are given a meaning in `understand.py`. Everything that the grammar does not know for
certain, such as the scope of `do not … and …`, is refused.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from itertools import pairwise
from typing import Final

from aeros.agent.errors import AgentError
from aeros.agent.instructions import english
from aeros.agent.instructions.english import Words
from aeros.spec.diagnostics.codes import quoted
from aeros.spec.diagnostics.words import normalized_words

MAX_WORDS: Final = 200
"""Limit on the words of an instruction."""

_SENTENCE_END: Final = re.compile(r"(?:[.;!?:\n\r\u2026]|--+|\s[-\u2013\u2014]\s)+")
_COMMA: Final = ","
_SIGNED_NUMBER: Final = re.compile(r"[-+\u2212\u00b1~<>=/.]\d+|\d+\s?[%/<>=]")
"""A number that means another one than its digits alone."""

_STARTS_LIST: Final = re.compile(r"\s*1[.)]\s")
_INLINE_NUMBER: Final = re.compile(r"(?<=\s)\d[.)]\s+")
_LIST_NUMBER: Final = re.compile(r"(?m)^\s*(?:\d+[.)]|[-*\u2022])\s+")


class InstructionError(AgentError):
    """An instruction that is not understood whole; `reason` says which words, and what can be said."""


class Link(Enum):
    """Connection of a segment with the segment before it."""

    START = "start"  # the first segment of a sentence
    JOINED = "joined"  # `and`, or a comma: may share words with the segment before
    THEN = "then"  # comes after the segment before
    AFTER = "after"  # comes before the segment before
    ADJUNCT = "adjunct"  # a prohibition or a condition, said after a request without a comma


class Mood(Enum):
    """Sort of a segment."""

    REQUEST = "request"
    PROHIBITION = "prohibition"
    CONDITION = "condition"


@dataclass(frozen=True, slots=True)
class Segment:
    """Words that mean one thing.

    Attributes:
        mood: request, prohibition or condition.
        words: its words, without openers, closers and the words of prohibition or condition.
        link: connection with the segment before it.
        marker: words of the prohibition or condition, as in `do not`; empty for a request.
        joint: word of the link, for messages; empty if there is none.
        is_new: True if its first words show that it is wanted, even after a prohibition.
        is_perfect: True if its verb is in the perfect, as in `once you have cleaned …`.
        openers: words before those of a request that change nothing in it, unless a task begins with them.
    """

    mood: Mood
    words: Words
    link: Link
    marker: Words = ()
    joint: str = ""
    is_new: bool = False
    is_perfect: bool = False
    openers: Words = ()

    @property
    def text(self) -> str:
        """Words for messages."""
        return " ".join(self.marker + self.words)


Sentence = tuple[Segment, ...]


def parse_instruction(instruction: str) -> tuple[Sentence, ...]:
    """Split an instruction into sentences of segments.

    Args:
        instruction: words of the user.

    Returns:
        The sentences that have words, in order.

    Raises:
        InstructionError: the instruction is empty, too long, a question, or has no one meaning.
    """
    if len(normalized_words(instruction)) > MAX_WORDS:
        raise InstructionError(f"the instruction has more than {MAX_WORDS} words")
    if signed := _SIGNED_NUMBER.search(instruction):
        raise InstructionError(f"the number {quoted(signed.group())} is not understood")
    sentences = [_parse_sentence(*one) for one in _sentences(instruction) if _strip_closers(one[0])]
    if not sentences:
        raise InstructionError("the instruction has no words")
    return tuple(sentences)


def _sentences(instruction: str) -> Iterator[tuple[Words, bool]]:
    """Yield words and commas of each sentence, and True if it ends with a question mark."""
    rest = _LIST_NUMBER.sub("\n", instruction)
    if _STARTS_LIST.match(instruction):
        rest = _INLINE_NUMBER.sub("\n", rest)
    position = 0
    while position < len(rest):
        end = _SENTENCE_END.search(rest, position)
        text = rest[position : end.start() if end else len(rest)]
        position = end.end() if end else len(rest)
        tokens: list[str] = []
        for part in text.split(_COMMA):
            if words := normalized_words(part):
                tokens += [_COMMA, *words] if tokens else words
        is_label = bool(end and ":" in end.group()) and tuple(tokens) in english.LABELS
        if tokens and not is_label:
            yield tuple(tokens), bool(end and "?" in end.group())


def _parse_sentence(tokens: Words, is_question: bool) -> Sentence:
    tokens = tokens[len(_match(tokens, 0, english.SENTENCE_OPENERS)) :]
    whole = tokens
    # Also after a comma, as in `…, will you?`.
    while (shorter := _strip_closers(tokens)) != tokens or tokens[-1:] == (_COMMA,):
        tokens = shorter if shorter[-1:] != (_COMMA,) else shorter[:-1]
    leading = _match(tokens, 0, english.LEADING) if _COMMA in tokens else ()
    segments = list(_segments(tokens[len(leading) :]))
    if not segments:
        raise InstructionError("the instruction asks for nothing")
    if leading:
        if len(segments) != 2:
            raise InstructionError("the order of more than two requests is clear only with `then`")
        comes_later = leading[0] in ("before", "prior")
        segments[0] = replace(segments[0], is_perfect=leading in english.PERFECT)
        segments[1] = replace(segments[1], link=Link.AFTER if comes_later else Link.THEN)
    if segments[0].mood is Mood.REQUEST:
        asked = _strip_openers(tokens)
        asks_ability = _match(whole, 0, english.OPENERS) in english.ABILITY and tokens == whole
        was_polite = asked != whole and not asks_ability
        if (is_question and not was_polite) or (asked and asked[0] in english.QUESTIONS):
            text = " ".join(token for token in whole if token != _COMMA)
            raise InstructionError(f"{quoted(text)} is a question; only requests are understood")
    return tuple(segments)


def _segments(tokens: Words) -> Iterator[Segment]:
    """Yield the segments of a sentence.

    Raises:
        InstructionError: a link has nothing after it, or a condition is on time.
    """
    position, link, joint = 0, Link.START, ""
    before: Mood | None = None
    while position < len(tokens):
        start, mood, marker = _begin_segment(tokens, position)
        end, next_link, next_joint = _end_segment(tokens, start, mood)
        whole = tokens[start:end]
        words = _strip_closers(whole)
        is_replacement = before is Mood.PROHIBITION and words[-1:] == ("instead",)
        words = words[:-1] if is_replacement else words
        after = end + len(next_joint.split())
        if not words and mood is Mood.REQUEST:
            # As in `hello, …` or `please, …`: only openers.
            position = after
            if link is Link.START and position < len(tokens):
                continue
            link, joint = _stronger(link, joint, next_link, next_joint)
            continue
        is_new = is_replacement or bool(_match(tokens, position, english.NEW_REQUEST))
        is_perfect = tuple(joint.replace(_COMMA, " ").split()) in english.PERFECT
        if words[-1:] == ("first",) and (link is Link.START or before is Mood.CONDITION):
            words = words[:-1]
        elif words[-1:] == ("first",) and joint.endswith("but"):
            words, link = words[:-1], Link.AFTER
        before = mood
        openers = tokens[position:start] if mood is Mood.REQUEST else ()
        yield Segment(mood, words, link, marker, joint, is_new, is_perfect, openers)
        position, link, joint = after, next_link, next_joint
    if link is not Link.START and joint not in ("", _COMMA) and position >= len(tokens):
        raise InstructionError(f"nothing follows after {quoted(joint)}")


def _stronger(link: Link, joint: str, other: Link, other_joint: str) -> tuple[Link, str]:
    return (other, other_joint) if link in (Link.START, Link.JOINED) else (link, joint)


def _begin_segment(tokens: Words, position: int) -> tuple[int, Mood, Words]:
    """Skip openers, and read the words of a prohibition or condition; return where its words start.

    Raises:
        InstructionError: a condition on time begins here.
    """
    while True:
        opener = _match(tokens, position, english.OPENERS)
        prohibition = _match(tokens, position, english.PROHIBITIONS)
        if prohibition and len(prohibition) >= len(opener):
            start = position + len(prohibition)
            while opener := _match(tokens, start, english.OPENERS):
                start += len(opener)
            return start, Mood.PROHIBITION, prohibition
        if opener and opener != tokens[position:]:
            position += len(opener)
            continue
        for phrases in (english.CONDITIONALS, english.TIME_CONDITIONALS):
            if condition := _match(tokens, position, phrases):
                if phrases is english.TIME_CONDITIONALS:
                    raise InstructionError(
                        f"{quoted(' '.join(condition))} is not understood: a request can have a condition "
                        "with `if` or `unless`, which is measured before it starts"
                    )
                return position + len(condition), Mood.CONDITION, condition
        return position, Mood.REQUEST, ()


def _end_segment(tokens: Words, start: int, mood: Mood) -> tuple[int, Link, str]:
    """Find where a segment ends; return that, and link and joint of the next."""
    for at in range(start, len(tokens)):
        if tokens[at] == _COMMA:
            following = _match(tokens, at + 1, english.SEQUENCE)
            if following:
                return at, _link_of(following), " ".join((_COMMA, *following))
            following = _match(tokens, at + 1, english.REVERSED)
            if following:
                return at, Link.AFTER, " ".join((_COMMA, *following))
            return at, Link.JOINED, _COMMA
        if at == start:
            continue
        if following := _match(tokens, at, english.SEQUENCE):
            return at, _link_of(following), " ".join(following)
        if mood is not Mood.CONDITION and (following := _match(tokens, at, english.REVERSED)):
            return at, Link.AFTER, " ".join(following)
        starts_adjunct = (
            _match(tokens, at, english.PROHIBITIONS)
            or _match(tokens, at, english.CONDITIONALS)
            or _match(tokens, at, english.TIME_CONDITIONALS)
        )
        if starts_adjunct and mood is not Mood.CONDITION:
            return at, Link.ADJUNCT, ""
    return len(tokens), Link.START, ""


def _link_of(joint: Words) -> Link:
    return Link.JOINED if joint in (("and",), ("plus",), ("as", "well", "as")) else Link.THEN


def _match(tokens: Words, position: int, phrases: Sequence[Words]) -> Words:
    """Return the longest of `phrases` that stands at `position`; empty if none does."""
    return next((one for one in phrases if tokens[position : position + len(one)] == one), ())


def _strip_openers(tokens: Words) -> Words:
    position = 0
    while opener := _match(tokens, position, english.OPENERS):
        position += len(opener)
    return tokens[position:]


def _strip_closers(words: Words) -> Words:
    while words:
        closer = next((one for one in english.CLOSERS if words[-len(one) :] == one), None)
        if closer is None:
            return words
        words = words[: -len(closer)]
    return words


def check_scopes(sentence: Sentence) -> Sentence:
    """Check that each prohibition and each condition of a sentence has one possible scope.

    Args:
        sentence: segments in the order in which they were said.

    Returns:
        The sentence in the order in which it is to be done: `A after B` is B, then A.

    Raises:
        InstructionError: a scope or an order is not certain.
    """
    for before, segment in pairwise(sentence):
        if before.mood is Mood.PROHIBITION and segment.mood is Mood.REQUEST:
            ends_itself = before.marker in _BOUNDED and segment.joint == _COMMA
            if segment.link is not Link.THEN and not ends_itself and not segment.is_new:
                raise InstructionError(
                    f"{quoted(before.text)}, {quoted(segment.text)}: is the second wanted, or prohibited, "
                    "too? say it in two sentences"
                )
    conditions = [at for at, segment in enumerate(sentence) if segment.mood is Mood.CONDITION]
    requests = sum(segment.mood is Mood.REQUEST for segment in sentence)
    # `…, and if the table is dirty, clean it` and `…, then clean the table if it is dirty`: the condition is
    # of the last request alone.
    link = sentence[-2].link if len(sentence) > 1 else None
    leads_last = conditions == [len(sentence) - 2] and link is not Link.ADJUNCT
    ends_last = conditions == [len(sentence) - 1] and link is Link.THEN
    if len(conditions) > 1 or (conditions and requests > 1 and not (leads_last or ends_last)):
        first = sentence[conditions[0]]
        raise InstructionError(
            f"which request depends on {quoted(first.text)}? say the condition and its request in a "
            "sentence of their own"
        )
    if any(segment.link is Link.AFTER for segment in sentence):
        if len(sentence) != 2 or any(segment.mood is not Mood.REQUEST for segment in sentence):
            raise InstructionError("the order of more than two requests is clear only with `then`")
        first, second = sentence
        return (replace(second, link=Link.START), replace(first, link=Link.THEN))
    return sentence


_BOUNDED: Final = frozenset(
    {("instead", "of"), ("rather", "than"), ("without",), ("not",), ("never", "mind"), ("forget", "about")}
)
"""Prohibitions that end at the next comma."""
