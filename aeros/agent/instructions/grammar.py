"""Grammar of instructions: sentences, and in them requests, prohibitions and conditions.

    instruction  = sentence { ("." | ";" | "!" | "?" | ":" | line end) sentence }
    sentence     = [OTHERWISE] segment { link segment }
    segment      = [openers] (words | prohibition words | conditional words) [closers] | reason words
    link         = "," | SEQUENCE | REVERSED, or nothing before a prohibition or a conditional

The words of a segment are given a meaning in `understand.py`. Everything that the grammar does not know for
certain, such as the scope of `do not … and …`, is refused.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from typing import Final

from aeros.agent.instructions import english
from aeros.agent.instructions.phrases import Words
from aeros.agent.instructions.reasons.reason_clauses import without_reasons
from aeros.agent.instructions.reasons.statements import is_free_remark, is_remark, is_statement
from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.segments import COLON, COMMA, Link, Mood, Segment, Sentence, without_commas
from aeros.agent.instructions.sentences.branches import with_branches
from aeros.agent.instructions.sentences.checks import CHECK, without_checks
from aeros.agent.instructions.sentences.clauses import (
    carried_words,
    segments_of,
    strip_closers,
    strip_ends,
    strip_openers,
)
from aeros.agent.instructions.sentences.rephrasing import rephrased, with_subject
from aeros.agent.instructions.sentences.spoken_sentences import spoken_sentences, with_labelled_values
from aeros.spec.diagnostics.codes import quoted
from aeros.spec.diagnostics.words import normalized_words

MAX_WORDS: Final = 200
"""Limit on the words of an instruction."""


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
    spoken = [one for one in spoken_sentences(instruction) if strip_ends(one[0])]
    spoken = list(with_labelled_values(spoken))
    spoken = [one for one in spoken if not _is_courtesy(one[0])] or spoken
    spoken = [
        _with_full_start(tokens, is_question=is_asked, is_last=at + 1 == len(spoken))
        for at, (tokens, is_asked) in enumerate(spoken)
    ]
    spoken = [one for at, one in enumerate(spoken) if at == 0 or not _UNSTRESSED.issuperset(one[0])]
    # `Two teas, please. Go.`
    spoken = [one for at, one in enumerate(spoken) if at == 0 or strip_openers(one[0])]
    sentences: list[Sentence] = []
    for tokens, is_question, is_otherwise in with_branches(without_checks(spoken)):
        if sentences and _is_prohibition(sentences[-1]):
            tokens = tuple(word for word in tokens if word != "instead")
        is_check, tokens = tokens[0] == CHECK, tokens[tokens[0] == CHECK :]
        sentence = _parse_sentence(tokens, is_question=is_question, is_first=not sentences)
        sentence = tuple(replace(one, is_otherwise=is_otherwise, is_check=is_check) for one in sentence)
        if sentences and english.SENTENCE_TURNS.starting(tokens):
            sentences[-1] = _turned(sentences[-1], sentence)
        else:
            sentences.append(sentence)
    if not sentences:
        words = " ".join(normalized_words(instruction))
        reason = f"{quoted(words)} asks for nothing" if words else "the instruction has no words"
        raise InstructionError(reason)
    return tuple(sentences)


def _with_full_start(tokens: Words, *, is_question: bool, is_last: bool) -> tuple[Words, bool]:
    """Write the start of a sentence in full, and a question that only points at a thing as its topic.

    `should the table be dirty, …` is `if the table is dirty, …`, `is possible …?` is `is it possible …?`, and
    `see the can? bring it` is `the can! bring it`.
    """
    if tokens[:2] == ("is", "possible"):
        return ("is", "it", *tokens[1:]), is_question
    pointing = english.POINTINGS.starting(tokens) if is_question and not is_last else ()
    if pointing and 1 < len(tokens) - len(pointing) <= _MAX_TOPIC:
        return tokens[len(pointing) :], False
    end = tokens.index(COMMA) if COMMA in tokens else 0
    if tokens[:1] != ("should",) or not end or is_question:
        return tokens, is_question
    return ("if", *("is" if word == "be" else word for word in tokens[1:end]), *tokens[end:]), is_question


_UNSTRESSED: Final = (english.FILLERS - {"here", "now", "task", "only", "still"}) | {"and", "but", COMMA}
_MAX_TOPIC: Final = 4
"""Limit on the words of a thing that a question points at."""


def _is_prohibition(sentence: Sentence) -> bool:
    return all(segment.mood is Mood.PROHIBITION for segment in sentence)


def _is_courtesy(tokens: Words) -> bool:
    """Return True for `good morning, dear robot`."""
    text = " ".join(COMMA if token == COLON else token for token in tokens)
    parts = [tuple(part.split()) for part in text.split(COMMA)]
    return all(part in english.GREETINGS for part in parts if part)


def _turned(before: Sentence, sentence: Sentence) -> Sentence:
    """Return both sentences as one for `fetch the can. But first, clean the table.`.

    Raises:
        InstructionError: one of them is more than a request.
    """
    both = [segment for segment in (*before, *sentence) if segment.mood is not Mood.REASON]
    reasons = [segment for segment in (*before, *sentence) if segment.mood is Mood.REASON]
    if len(both) != 2 or any(segment.mood is not Mood.REQUEST for segment in both):
        raise InstructionError("the order of more than two requests is clear only with `then`")
    return (both[0], replace(both[1], link=Link.AFTER), *reasons)


def _parse_sentence(tokens: Words, *, is_question: bool, is_first: bool) -> Sentence:
    _require_no_hedge(tokens, is_question=is_question)
    _require_own_courtesy(tokens)
    link = english.SENTENCE_OPENERS.starting(tokens)
    link = () if len(english.LEADING.starting(tokens)) > len(link) else link
    # `once you have done the teas, …`
    is_of_thing = not english.DETERMINERS.isdisjoint(tokens[len(link) : len(link) + 1])
    link = () if link[-1:] in _DONE and is_of_thing else link
    if is_first and not _REFERRING.isdisjoint(link) and not _OVER.isdisjoint(link):
        text = quoted(" ".join(link))
        raise InstructionError(f"{text} may ask to wait; nothing before it says what is to be done first")
    # At the very start, `later` is a time, and links nothing.
    tokens = tokens if is_first and link == _LATER else tokens[len(link) :]
    tokens = _without_now(tokens) if is_question else with_subject(tokens)
    tokens, remarks = _without_remarks(tokens)
    tokens, reasons = _without_statements(tokens, is_question=is_question)
    reasons = remarks + reasons
    if reasons:
        tokens = tokens[len(english.CONCLUSIONS.starting(tokens)) :]
    whole = tokens
    if reasons and not tokens:
        return tuple(reasons)
    tokens = tuple(COMMA if token == COLON else token for token in tokens)
    tokens, more = without_reasons(rephrased(_without_greeting(tokens)))
    reasons += more
    tokens, closers = strip_ends(tokens), tokens
    closers = closers[len(tokens) :]
    opener = english.OPENERS.starting(tokens)
    leading = english.LEADING.starting(tokens) if COMMA in tokens else ()
    leading = () if len(opener) > len(leading) else leading
    segments = list(segments_of(tokens[len(leading) :]))
    if opener == ("first",):
        # `first you wipe the table, after you bring the can`
        segments = [
            replace(one, link=Link.THEN) if one.joint in _AFTERWARDS and one.link is Link.AFTER else one
            for one in segments
        ]
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
        _require_request(whole, tokens, is_question=is_question, has_reason=bool(reasons))
    if segments[-1].mood is Mood.CONDITION:
        segments[-1] = replace(segments[-1], closers=without_commas(closers))
    closers = closers[: closers.index(COMMA)] if COMMA in closers else closers
    if segments[-1].mood is Mood.REQUEST:
        segments[-1] = replace(segments[-1], closers=segments[-1].closers + closers)
    if len(segments) > 1 and segments[-1].mood is Mood.CONDITION and segments[-2].mood is Mood.REQUEST:
        # As in `clean it, but only if it is dirty`.
        segments[-1] = replace(segments[-1], link=Link.ADJUNCT)
    is_cued = (
        opener in _ORDER_OPENERS
        or (link == _NEXT and not is_first)
        or not _ORDER_CUES.isdisjoint((*opener, *closers))
    )
    is_cued = is_cued or (_is_order(tokens) and _THANKS.isdisjoint(whole))  # `one tea for me and one for Ben`
    is_polite = any(word in _POLITE for word in whole) or _is_order(whole) or is_cued
    carried = carried_words(segments, is_order=_is_order(whole) or _is_wish(segments[0], is_polite=is_polite))
    ends = next((at for at, one in enumerate(segments) if at and _has_own_verb(one)), len(segments))
    spoken = (
        replace(
            one, is_polite=is_polite, carried=_carried_to(one, segments[0], carried) if 0 < at <= ends else ()
        )
        for at, one in enumerate(segments)
    )
    return (*spoken, *reasons)


def _without_now(tokens: Words) -> Words:
    """Return a question without `now` or the like at its end, which makes no wish of it: `tea now?`."""
    end = english.WISH_ENDS.ending(tokens)
    is_time = 0 < len(end) <= 2 and end[-1] in _NOW
    return tokens[: -len(end)] if is_time and len(end) < len(tokens) else tokens


_NOW: Final = ("now", "once", "immediately", "asap", "pronto")


def _carried_to(segment: Segment, first: Segment, carried: tuple[Words, ...]) -> tuple[Words, ...]:
    """Return what goes on: not the wish of `I want the table cleaned, then the can`, which may be cleaned."""
    start = segment.words[:1]
    is_new = start in english.INDEFINITE or english.number_of("".join(start)) is not None
    is_of_act = bool(first.words) and bool(english.participle_bases(first.words[-1]))
    return tuple(one for one in carried if is_new or not is_of_act or one != ("i", "want"))


def _is_wish(segment: Segment, *, is_polite: bool) -> bool:
    """Return True for `a tea` of `a tea and the can, please`."""
    return is_polite and segment.words[:1] in english.INDEFINITE


def _has_own_verb(segment: Segment) -> bool:
    """Return True for `clean the table`, after which no words of an earlier request go on."""
    first = segment.words[0] if segment.mood is Mood.REQUEST and segment.words else "the"
    is_thing = first in _STARTS_THING or english.number_of(first) is not None
    return not (is_thing or english.is_plural(first))


_STARTS_THING: Final = english.DETERMINERS | english.POSSESSIVES | english.SUBJECTS | english.PRONOUNS


def _without_remarks(tokens: Words) -> tuple[Words, list[Segment]]:
    """Take remarks between pauses from a sentence: `phew, what a day, wipe the table, my back hurts`.

    Raises:
        InstructionError: one withdraws the rest, as in `clean the table, yeah right`.
    """
    kept: list[Words] = []
    remarks: list[Segment] = []
    for part in _parts(tokens):
        words = without_commas(part)
        if words in english.WITHDRAWALS:
            raise InstructionError(f"{quoted(' '.join(words))} may take back what is said before it")
        # `please, the table is dirty, wipe it`: the remark is what `it` means
        is_further = any(strip_openers(without_commas(one)) for one in kept)
        if words and COLON not in words and (is_free_remark(words) or (is_further and is_remark(words))):
            remarks.append(Segment(Mood.REASON, words, Link.ADJUNCT))
        else:
            kept.append(part)
    rest = tuple(token for part in kept for token in part)
    return (rest[1:] if rest[:1] == (COMMA,) else rest), remarks


def _parts(tokens: Words) -> Iterator[Words]:
    """Yield the words from each comma, which comes first, to the next."""
    begin = 0
    for at, token in enumerate((*tokens, COMMA)):
        if token == COMMA and at > begin:
            yield tokens[begin:at]
            begin = at


def _without_statements(tokens: Words, *, is_question: bool) -> tuple[Words, list[Segment]]:
    """Take statements from the start of a sentence: `we spilled some juice, please wipe the table`."""
    reasons: list[Segment] = []
    while tokens:
        while (rest := _without_greeting(tokens)) != tokens:
            # `my back hurts, so clean it`
            tokens = rest[1:] if rest[:1] == ("so",) else rest
        end = next((at for at in range(len(tokens)) if _ends_statement(tokens, at)), len(tokens))
        statement = tokens[:end] if is_statement(tokens[:end]) else strip_closers(tokens[:end])
        is_report = tokens[end : end + 1] == (COLON,) and not english.OPENERS.starting(tokens, end + 1)
        if is_report or not is_statement(statement) or (is_question and end == len(tokens)):
            break
        end += tokens[end : end + 1] in ((COMMA,), (COLON,))
        so = english.CONCLUSIONS.starting(tokens, end)
        reasons.append(Segment(Mood.REASON, statement, Link.START, so))
        tokens = tokens[end + len(so) :]
    return tokens, reasons


def _ends_statement(tokens: Words, at: int) -> bool:
    """Return True at a pause, and, in a transcript without pauses, before `so please` and `could you`."""
    if tokens[at] in (COMMA, COLON):
        return True
    if at <= 1:
        return False
    so = tokens[at] == "so"
    opener = english.OPENERS.starting(tokens, at + so)
    is_asked = bool(_POLITE.intersection(opener)) or opener[:2] in _ASKED or (so and len(opener) > 1)
    # `the table is dirty so clean it`; `the table is so clean …` says how much
    follows_reason = so and tokens[at - 1] not in _BEFORE_DEGREES and not tokens[at - 1].endswith("ly")
    follows_reason = follows_reason and tokens[at + 1 : at + 2] != (COMMA,) and _starts_object(tokens, at + 2)
    follows_reason = follows_reason and english.SUBJECTS.isdisjoint(tokens[at + 1 : at + 2])
    # `they will please wipe it`: what they will do has not been said yet
    is_open = tokens[at - 1] in _OPEN_MODALS or (tokens[at - 1] == "can" and tokens[at - 2] in _WHO)
    return not is_open and (is_asked or follows_reason) and is_statement(tokens[:at])


def _starts_object(tokens: Words, at: int) -> bool:
    """Return True at the object of a verb: `the table`, `two teas`, `it`, or `up the table`."""
    at += tokens[at : at + 1] != () and tokens[at] in english.PARTICLES
    words = tokens[at : at + 1]
    is_named = not (english.DETERMINERS | english.POSSESSIVES | english.PRONOUNS).isdisjoint(words)
    return is_named or any(english.number_of(word) is not None for word in words)


_OPEN_MODALS: Final = english.MODALS - {"can", "need", "needs"}
_WHO: Final = frozenset({"he", "i", "she", "they", "we", "who", "you"})
_BEFORE_DEGREES: Final = (
    english.FINITE | english.MODALS | english.DEGREES | {"always", "never", "not", "often"}
)
_ASKED: Final = (("can", "you"), ("could", "you"), ("would", "you"), ("will", "you"))


def _without_greeting(tokens: Words) -> Words:
    """Remove what asks for nothing before the first comma: `dear robot, …`, `before lunch, …`."""
    end = tokens.index(COMMA) if COMMA in tokens else 0
    rest = strip_openers(tokens[:end])
    if tokens[:end] in english.GREETINGS:
        return tokens[end + 1 :]
    if rest[:1] in _TIMES and (rest in english.CLOSERS or rest in english.DEADLINES):
        return tokens[end + 1 :]
    return tokens[end + 1 :] if end and not rest and not english.SENTENCE_TURNS.starting(tokens) else tokens


def _require_own_courtesy(tokens: Words) -> None:
    """Require that `if it is no trouble` is courtesy to the robot, and no condition of what suits others.

    Raises:
        InstructionError: it is of others, as `if it is no trouble for the guests`.
    """
    for at in (at for at, token in enumerate(tokens) if token in _SUPPOSING):
        found = max(english.OPENERS.starting(tokens, at), english.CLOSERS.starting(tokens, at), key=len)
        rest = tokens[at + len(found) :]
        if found and "you" not in found and rest[:1] == ("for",) and rest[1:2] not in _SPEAKERS:
            condition = " ".join(tokens[at : rest.index(COMMA) + at + len(found) if COMMA in rest else None])
            raise InstructionError(f"the condition {quoted(condition)} is not understood")


_SUPPOSING: Final = frozenset({"if", "when", "whenever"})
_SPEAKERS: Final = (("me",), ("us",), ("you",))


def _require_no_hedge(tokens: Words, *, is_question: bool) -> None:
    """Require that `maybe` is courtesy, as in `maybe you could make a tea?`.

    Raises:
        InstructionError: it leaves open if the thing is wanted, as in `maybe make a tea`.
    """
    is_asked = any(pair in _ASKED for pair in pairwise(tokens))
    is_courteous = is_question or is_asked or not _POLITE.isdisjoint(tokens)
    hedge = next((word for word in tokens if word in english.HEDGES), "")
    if hedge and not is_courteous:
        raise InstructionError(f"{quoted(hedge)} leaves open if {quoted(' '.join(tokens))} is wanted")


_DONE: Final = (("done",), ("finished",))
_TIMES: Final = (("before",), ("by",))
_AFTERWARDS: Final = frozenset({f"{COMMA} after", f"{COMMA} after you"})
_LATER: Final = ("later",)
_REFERRING: Final = frozenset({"it", "that", "this"})
_OVER: Final = frozenset({"been", "complete", "completed", "done", "finished", "over", "ready"})
_NEXT: Final = ("next",)
_THANKS: Final = frozenset({"thank", "thanks"})
_ORDER_CUES: Final = frozenset({"asap", "immediately", "just", "mind", "now", "only", "quick", "time"})
_ORDER_OPENERS: Final = (
    ("first",),
    ("firstly",),
    ("second",),
    ("secondly",),
    ("third",),
    ("thirdly",),
    ("fourth",),
)
_POLITE: Final = frozenset({"please", "pls", "plz", "kindly"})


def _is_order(whole: Words) -> bool:
    """Return True for `two teas`, which asks for them; thanks may be for others."""
    first = strip_openers(_without_greeting(whole))[:1]
    is_number = any(english.number_of(word.removeprefix("x")) is not None for word in first)
    return is_number and first not in english.INDEFINITE and _THANKS.isdisjoint(whole)


def _require_request(whole: Words, tokens: Words, *, is_question: bool, has_reason: bool) -> None:
    """Require that a sentence is no question.

    `can you clean tables?` asks about an ability; `can you clean the table?` is a request, as it names a
    definite thing.

    Raises:
        InstructionError: it is one.
    """
    asked = strip_openers(tokens)
    is_definite = any(word in _DEFINITE for word in asked) or any(map(_says_number, asked[:-1], asked[1:]))
    opener = english.OPENERS.starting(whole)
    asks_ability = opener in english.ABILITY and tokens == whole and not is_definite and not has_reason
    # `the block, could you fetch it?`
    commas = [at for at, token in enumerate(tokens) if token == COMMA]
    asks_later = any(len(english.OPENERS.starting(tokens, at + 1)) > 1 for at in commas)
    was_polite = (asked != whole or asks_later) and not asks_ability
    causative = english.CAUSATIVES.starting(asked)
    is_wish = bool(english.WISHES.starting(asked)) or len(causative) > 1 or causative == ("could",)
    # `have a look at it, would you?`
    is_asked_for = not is_question or asked != tokens or whole[-2:] in _ASKED
    is_causative = asked[:1] == ("have",) and asked[1:2] not in _ADDRESSED and is_asked_for
    starts_question = bool(asked) and asked[0] in english.QUESTIONS and not is_causative
    # `do i need tea?`
    asks_need = whole[:1] == ("do",) and whole[1:2] in _ADDRESSED[1:] and is_question
    asks_need = asks_need or (is_question and _asks_back(whole))
    if asks_need or (is_question and not (was_polite or is_wish)) or (starts_question and not is_wish):
        text = " ".join(token for token in whole if token != COMMA)
        raise InstructionError(f"{quoted(text)} is a question; only requests are understood")


def _asks_back(whole: Words) -> bool:
    """Return True for `so you make tea?`, which asks what the robot does; not for `you could make tea?`."""
    linked = next((at for at, word in enumerate(whole) if word not in _LINKS), 0)
    opener = english.OPENERS.starting(whole, linked)
    is_asked = whole[-2:] in _ASKED or not _POLITE.isdisjoint(whole)
    return opener[:1] == ("you",) and opener[1:2] not in _POLITE_MODALS and not is_asked


_LINKS: Final = _UNSTRESSED | {"then", "well"}
_POLITE_MODALS: Final = (("could",), ("would",), ("couldn",), ("wouldn",), ("might",), ("d",))
_ADDRESSED: Final = (("you",), ("i",), ("we",), ("they",), ("he",), ("she",), ("it",))


def _says_number(word: str, following: str) -> bool:
    """Return True for `two teas` and `one tea`; `one` alone may be any."""
    number = english.number_of(word) or 0
    return number > 1 or (word == "one" and following != COMMA)


_DEFINITE: Final = frozenset(
    {"the", "this", "that", "these", "those", "my", "our", "your", "me", "us", "it", "them"}
)


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
        if segment.mood is Mood.PROHIBITION and segment.joint.split()[:1] == ["before"]:
            raise InstructionError(f"{quoted(f'{segment.joint} {segment.text}')} says no order")
        is_second = before.mood is segment.mood is Mood.REQUEST
        if is_second and before.openers[:1] in _IF and segment.joint == COMMA:
            # `if you find the time to wipe the table, bring the can`
            raise InstructionError(
                f"is {quoted(segment.text)} wanted in any case? join it by `and`, or say it apart"
            )
        is_after = before.mood is Mood.PROHIBITION and segment.mood is Mood.REQUEST
        if is_after and not (segment.is_new or _ends_before(before, segment)):
            raise InstructionError(
                f"{quoted(before.text)}, {quoted(segment.text)}: is the second wanted, or prohibited, "
                "too? say it in two sentences"
            )
    for before, segment in pairwise(sentence):
        is_after = before.mood is Mood.PROHIBITION and segment.mood is Mood.CONDITION
        if is_after and segment.link is not Link.ADJUNCT and "but" not in segment.joint.split():
            # `do not check it and, if it is dirty, wipe it`
            raise InstructionError(
                f"{quoted(before.text)}, {quoted(segment.text)}: is what follows wanted, or prohibited, too? "
                "say it in two sentences"
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
    # `clean it if it is dirty, and cook in any case`
    ends_first |= conditions == [1] and all(english.IN_ANY_CASE.ending(one.closers) for one in sentence[2:])
    if conditions and sentence[conditions[0]].marker not in english.CONCESSIONS:
        _require_no_contradiction(sentence[conditions[0]], sentence[:2] if ends_first else sentence)
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


def _ends_before(prohibition: Segment, segment: Segment) -> bool:
    """Return True if a prohibition ends before a request of its sentence.

    `do not make tea, then wipe the table` may prohibit both, one after the other.
    """
    joint = segment.joint.split()
    if not {"before", "prior"}.isdisjoint(joint):
        return False  # `do not fetch it before wiping the table` says an order only
    first = "".join(prohibition.words[:1])
    is_act = english.is_gerund(first)
    if is_act and not segment.openers and english.is_gerund("".join(segment.words[:1])):
        return False  # `instead of making tea, wiping the table, …`
    marker = prohibition.marker
    if segment.link is Link.THEN and ("but" in joint or marker[0] in _OF_THINGS):
        return True
    # `stop making tea and wipe the table`
    if (is_act and marker in _BEFORE_GERUND) or (marker[:2] in _BOUNDED and joint == [COMMA]):
        return True
    # `I do not want the can, bring me the cup`
    has_object = segment.words[1:2] and segment.words[1] in _STARTS_THING | _RECEIVERS
    is_of_thing = marker[-1] in _WANTED and (first in english.DETERMINERS or english.is_plural(first))
    is_of_thing &= joint == [COMMA]
    # `fetch everything except the can, then wipe the table`
    is_exception = marker[0] == "except" and first in english.DETERMINERS | english.POSSESSIVES
    is_of_thing |= is_exception and english.PRONOUNS.isdisjoint(segment.words)
    return is_of_thing and bool(has_object) and _has_own_verb(segment)


def _require_no_contradiction(condition: Segment, governed: Sentence) -> None:
    """Require that no request of a condition is to be done in any case.

    Raises:
        InstructionError: one is, as in `bring the can if the table is dirty, either way`.
    """
    for segment in governed:
        if always := english.IN_ANY_CASE.ending(segment.closers):
            raise InstructionError(f"{quoted(condition.text)} contradicts {quoted(' '.join(always))}")


_IF: Final = (("if",), ("when",), ("whenever",))
_BEFORE_GERUND: Final = (("skip",), ("stop",), ("quit",), ("cease",), ("avoid",), ("without",))
_OF_THINGS: Final = frozenset(
    {"avoid", "cease", "drop", "forget", "no", "quit", "skip", "spare", "stop", "without"}
)
"""First words of prohibitions of things and of acts by their noun, with which no imperative can go on."""

_WANTED: Final = frozenset({"need", "want"})
_RECEIVERS: Final = frozenset({"me", "us"})
_BOUNDED: Final = frozenset(
    {
        ("instead", "of"),
        ("rather", "than"),
        ("in", "place"),
        ("without",),
        ("not",),
        ("never", "mind"),
        ("forget", "about"),
    }
)
"""Prohibitions that end at the next comma."""
