"""Grammar of instructions: sentences, and in them requests, prohibitions and conditions.

    instruction  = sentence { ("." | ";" | "!" | "?" | ":" | line end) sentence }
    sentence     = segment { link segment }
    segment      = [openers] (words | prohibition words | conditional words) [closers] | reason words
    link         = "," | SEQUENCE | REVERSED, or nothing before a prohibition or a conditional

The words of a segment are given a meaning in `understand.py`. Everything that the grammar does not know for
certain, such as the scope of `do not … and …`, is refused.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import Enum
from itertools import pairwise
from typing import Final

from aeros.agent.errors import AgentError
from aeros.agent.instructions import english
from aeros.agent.instructions.phrases import Words
from aeros.spec.diagnostics.codes import quoted
from aeros.spec.diagnostics.words import normalized_words

MAX_WORDS: Final = 200
"""Limit on the words of an instruction."""

_SENTENCE_END: Final = re.compile(r"(?:[.;!?:\n\r\u2026]|--+|\s[-\u2013\u2014]\s)+")
_COLON: Final = ":"
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
    REASON = "reason"


@dataclass(frozen=True, slots=True)
class Segment:
    """Words that mean one thing.

    Attributes:
        mood: request, prohibition or condition.
        words: its words, without openers, closers and the words of prohibition or condition.
        link: connection with the segment before it.
        marker: words of the prohibition, condition or reason, as in `do not`; empty for a request.
        joint: word of the link, for messages; empty if there is none.
        is_new: True if its first words show that it is wanted, even after a prohibition.
        is_perfect: True if its verb is in the perfect, as in `once you have cleaned …`.
        openers: words before those of a request that change nothing in it, unless a task begins with them.
        is_polite: True if its sentence has a word such as `please`.
    """

    mood: Mood
    words: Words
    link: Link
    marker: Words = ()
    joint: str = ""
    is_new: bool = False
    is_perfect: bool = False
    openers: Words = ()
    is_polite: bool = False

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
    spoken = [one for one in _sentences(instruction) if _strip_closers(one[0])]
    spoken = [one for one in spoken if one[0] not in english.GREETINGS] or spoken
    sentences = [
        _parse_sentence(tokens, is_question=is_question, is_first=number == 0)
        for number, (tokens, is_question) in enumerate(spoken)
    ]
    if not sentences:
        raise InstructionError("the instruction has no words")
    return tuple(sentences)


def _sentences(instruction: str) -> Iterator[tuple[Words, bool]]:
    """Yield words and commas of each sentence, and True if it ends with a question mark."""
    rest = _LIST_NUMBER.sub("\n", instruction)
    if _STARTS_LIST.match(instruction):
        rest = _INLINE_NUMBER.sub("\n", rest)
    position = 0
    tokens: list[str] = []
    while position < len(rest):
        end = _SENTENCE_END.search(rest, position)
        text = rest[position : end.start() if end else len(rest)]
        position = end.end() if end else len(rest)
        for part in text.split(_COMMA):
            if words := english.respelt(normalized_words(part)):
                tokens += [_COMMA, *words] if tokens else words
        if end and end.group().strip() == _COLON and tuple(tokens) in english.LABELS:
            tokens = []
        elif end and end.group().strip() == _COLON and position < len(rest):
            continue  # `the table: clean it` is `the table, clean it`
        elif tokens:
            is_label = bool(end and _COLON in end.group()) and tuple(tokens) in english.LABELS
            if not is_label:
                yield tuple(tokens), bool(end and "?" in end.group())
            tokens = []


def _parse_sentence(tokens: Words, *, is_question: bool, is_first: bool) -> Sentence:
    link = english.SENTENCE_OPENERS.starting(tokens)
    # At the very start, `later` is a time, and links nothing.
    tokens = tokens if is_first and link == _LATER else tokens[len(link) :]
    if tokens[:1] == ("should",) and _COMMA in tokens and not is_question:
        # `should the table be dirty, …`
        tokens = ("if", *("is" if word == "be" else word for word in tokens[1:]))
    whole = tokens
    tokens = _with_leading_prohibition(tokens)
    tokens, reasons = _without_reasons(tokens)
    tokens = _strip_ends(tokens)
    opener = english.OPENERS.starting(tokens)
    leading = english.LEADING.starting(tokens) if _COMMA in tokens else ()
    leading = () if len(opener) > len(leading) else leading
    segments = list(_segments(tokens[len(leading) :]))
    if not segments:
        raise InstructionError("the instruction asks for nothing")
    if leading:
        if len(segments) != 2:
            raise InstructionError("the order of more than two requests is clear only with `then`")
        comes_later = leading[0] in ("before", "prior")
        # `after the tea is made, …` is in the perfect, too.
        is_perfect = leading in english.PERFECT or leading == ("after",)
        segments[0] = replace(segments[0], is_perfect=is_perfect)
        segments[1] = replace(segments[1], link=Link.AFTER if comes_later else Link.THEN)
    if segments[0].mood is Mood.REQUEST:
        _require_request(whole, tokens, is_question=is_question)
    if len(segments) > 1 and segments[-1].mood is Mood.CONDITION and segments[-2].mood is Mood.REQUEST:
        # As in `clean it, but only if it is dirty`.
        segments[-1] = replace(segments[-1], link=Link.ADJUNCT)
    if any(word in _POLITE for word in whole):
        segments = [replace(one, is_polite=True) for one in segments]
    return (*segments, *reasons)


def _with_leading_prohibition(tokens: Words) -> Words:
    """Rewrite `the table must not be cleaned` as `do not the table cleaned`."""
    for at in range(1, len(tokens)):
        if tokens[at] == _COMMA:
            break
        if duty := english.NEGATIVE_DUTIES.starting(tokens, at):
            return ("do", "not", *tokens[:at], *tokens[at + len(duty) :])
    return tokens


_LATER: Final = ("later",)
_POLITE: Final = frozenset({"please", "pls", "plz", "kindly"})


def _strip_ends(tokens: Words) -> Words:
    """Remove what asks for nothing at the end, also after a comma, as in `…, will you?`."""
    while (shorter := _strip_closers(tokens)) != tokens or tokens[-1:] == (_COMMA,):
        tokens = shorter if shorter[-1:] != (_COMMA,) else shorter[:-1]
    return tokens


def _require_request(whole: Words, tokens: Words, *, is_question: bool) -> None:
    """Require that a sentence is no question.

    `can you clean tables?` asks about an ability; `can you clean the table?` is a request, as it names a
    definite thing.

    Raises:
        InstructionError: it is one.
    """
    asked = _strip_openers(tokens)
    is_definite = any(word in _DEFINITE for word in asked)
    opener = english.OPENERS.starting(whole)
    asks_ability = opener in english.ABILITY and tokens == whole and not is_definite
    was_polite = asked != whole and not asks_ability
    causative = english.CAUSATIVES.starting(asked)
    is_wish = bool(english.WISHES.starting(asked)) or len(causative) > 1 or causative == ("could",)
    is_asked_for = not is_question or asked != tokens
    is_causative = asked[:1] == ("have",) and asked[1:2] not in _ADDRESSED and is_asked_for
    starts_question = bool(asked) and asked[0] in english.QUESTIONS and not is_causative
    if (is_question and not (was_polite or is_wish)) or (starts_question and not is_wish):
        text = " ".join(token for token in whole if token != _COMMA)
        raise InstructionError(f"{quoted(text)} is a question; only requests are understood")


_ADDRESSED: Final = (("you",), ("i",), ("we",), ("they",), ("he",), ("she",), ("it",))
_DEFINITE: Final = frozenset(
    {"the", "this", "that", "these", "those", "my", "our", "your", "me", "us", "it", "them"}
)


def _without_reasons(tokens: Words) -> tuple[Words, list[Segment]]:
    """Take the reasons out of a sentence: `because …`, `so that …`, and `the …, so` before a request.

    Raises:
        InstructionError: it is not clear where a reason ends.
    """
    reasons: list[Segment] = []
    at = 0
    while at < len(tokens):
        marker = english.REASONS.starting(tokens, at)
        after = at + len(marker)
        if marker == ("so",) and at and tokens[0] in english.SUBJECTS and not reasons:
            # `the table is dirty, so please clean it`
            reasons.append(Segment(Mood.REASON, _without_commas(tokens[:at]), Link.START, marker))
            tokens, at = tokens[after:], 0
        elif marker and _begins_reason(tokens, at, marker):
            end = next((to for to in range(after, len(tokens)) if _ends_reason(tokens, to)), len(tokens))
            if end == after or (at == 0 and tokens[end : end + 1] != (_COMMA,)):
                return tokens, reasons
            if at and tokens[end : end + 1] == (_COMMA,) and not english.SEQUENCE.starting(tokens, end + 1):
                rest = quoted(" ".join(tokens[end + 1 :]))
                raise InstructionError(
                    f"is {rest} a part of the reason, or wanted, too? say it in two sentences"
                )
            link = Link.ADJUNCT if at else Link.START
            reasons.append(Segment(Mood.REASON, tokens[after:end], link, marker))
            tokens = tokens[:at] + tokens[end + (at == 0) :]
        else:
            at += 1
    return tokens, reasons


def _begins_reason(tokens: Words, at: int, marker: Words) -> bool:
    after = tokens[at + len(marker) : at + len(marker) + 1]
    longer = max(
        map(len, (english.SEQUENCE.starting(tokens, at), english.SENTENCE_OPENERS.starting(tokens, at)))
    )
    if not after or after == (_COMMA,) or longer > len(marker):
        return False
    return marker[0] in ("because", "due", "in") or marker[-1] == "that" or after[0] in english.SUBJECTS


def _ends_reason(tokens: Words, at: int) -> bool:
    link = english.SEQUENCE.starting(tokens, at)
    return (
        tokens[at] == _COMMA
        or (bool(link) and link != ("and",))
        or bool(english.REASONS.starting(tokens, at))
    )


def _without_commas(tokens: Words) -> Words:
    return tuple(token for token in tokens if token != _COMMA)


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
        is_new = is_replacement or bool(english.NEW_REQUEST.starting(tokens, position))
        is_perfect = tuple(joint.replace(_COMMA, " ").split()) in english.PERFECT
        is_perfect = is_perfect or bool(english.PAST_OPENERS.starting(tokens, position))
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
        opener = english.OPENERS.starting(tokens, position)
        prohibition = english.PROHIBITIONS.starting(tokens, position)
        if prohibition and len(prohibition) >= len(opener):
            start = position + len(prohibition)
            while opener := english.OPENERS.starting(tokens, start):
                start += len(opener)
            return start, Mood.PROHIBITION, prohibition
        if opener and opener != tokens[position:]:
            position += len(opener)
            continue
        for phrases in (english.CONDITIONALS, english.TIME_CONDITIONALS):
            if condition := phrases.starting(tokens, position):
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
            following = english.SEQUENCE.starting(tokens, at + 1)
            turned = english.REVERSED.starting(tokens, at + 1)
            if len(turned) > len(following):
                return at, Link.AFTER, " ".join((_COMMA, *turned))
            if following:
                return at, _link_of(following), " ".join((_COMMA, *following))
            return at, Link.JOINED, _COMMA
        if at == start:
            continue
        if following := english.SEQUENCE.starting(tokens, at):
            return at, _link_of(following), " ".join(following)
        if mood is not Mood.CONDITION and (following := english.REVERSED.starting(tokens, at)):
            return at, Link.AFTER, " ".join(following)
        starts_adjunct = (
            english.PROHIBITIONS.starting(tokens, at)
            or english.CONDITIONALS.starting(tokens, at)
            or english.TIME_CONDITIONALS.starting(tokens, at)
        )
        if starts_adjunct and mood is not Mood.CONDITION:
            return at, Link.ADJUNCT, ""
    return len(tokens), Link.START, ""


def _link_of(joint: Words) -> Link:
    return Link.JOINED if joint in (("and",), ("plus",), ("as", "well", "as")) else Link.THEN


def _strip_openers(tokens: Words) -> Words:
    position = 0
    while opener := english.OPENERS.starting(tokens, position):
        position += len(opener)
    return tokens[position:]


def _strip_closers(words: Words) -> Words:
    while words:
        closer = english.CLOSERS.ending(words)
        if not closer:
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
    sentence = tuple(segment for segment in sentence if segment.mood is not Mood.REASON)
    for before, segment in pairwise(sentence):
        if before.mood is segment.mood is Mood.PROHIBITION and segment.link is Link.ADJUNCT:
            raise InstructionError(
                f"{quoted(f'{before.text} {segment.text}')} negates twice, which is not understood"
            )
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
    # `clean it if it is dirty, then cook`: of the first request alone.
    ends_first = conditions == [1] and all(one.link is Link.THEN for one in sentence[2:])
    is_certain = leads_last or ends_last or (ends_first and sentence[1].link is Link.ADJUNCT)
    if len(conditions) > 1 or (conditions and requests > 1 and not is_certain):
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
