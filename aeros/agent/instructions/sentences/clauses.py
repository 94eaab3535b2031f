"""Splitting of a sentence into segments: requests, prohibitions and conditions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from aeros.agent.instructions import english
from aeros.agent.instructions.phrases import Words
from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.segments import COMMA, Link, Mood, Segment
from aeros.spec.diagnostics.codes import quoted


def segments_of(tokens: Words) -> Iterator[Segment]:
    """Split a sentence into segments.

    Args:
        tokens: words and commas.

    Yields:
        The segments in order.

    Raises:
        InstructionError: a link has nothing after it, or a condition is on time.
    """
    position, link, joint = 0, Link.START, ""
    was_first = False
    before: Mood | None = None
    while position < len(tokens):
        start, mood, marker = _begin_segment(tokens, position)
        end, next_link, next_joint = _end_segment(tokens, start, mood)
        whole = tokens[start:end]
        words = strip_closers(whole)
        deadline = english.DEADLINES.ending(words) if mood is Mood.REQUEST else ()
        if 0 < len(deadline) < len(words):
            words = strip_closers(words[: -len(deadline)])
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
        is_perfect = tuple(joint.replace(COMMA, " ").split()) in english.PERFECT
        is_perfect = is_perfect or bool(english.PAST_OPENERS.starting(tokens, position))
        if words[-1:] in _ORDINALS and was_first and link is not Link.START:
            words = words[:-1]  # `the can first and the block second`
        if words[-1:] == ("first",) and (link is Link.START or before is Mood.CONDITION):
            words, was_first = words[:-1], True
        elif words[-1:] == ("first",) and (
            joint.endswith("but") or link is Link.AFTER or (joint == COMMA and english.is_gerund(words[0]))
        ):
            words, link = words[:-1], Link.AFTER  # `…, having wiped the table first`
        before = mood
        openers = tokens[position:start] if mood is Mood.REQUEST else ()
        is_light = bool(english.LIGHT_VERBS.ending(openers))
        closers = whole[len(words) :] if mood is Mood.REQUEST and whole[: len(words)] == words else ()
        yield Segment(
            mood, words, link, marker, joint, is_new, is_perfect, openers, closers, is_light=is_light
        )
        position, link, joint = after, next_link, next_joint
    if link is not Link.START and joint not in ("", COMMA) and position >= len(tokens):
        raise InstructionError(f"nothing follows after {quoted(joint)}")


_ORDINALS: Final = (("second",), ("third",), ("last",), ("next",), ("afterwards",))


def carried_words(segments: Sequence[Segment], *, is_order: bool = False) -> tuple[Words, ...]:
    """Find the words of the first request that later ones of its sentence may go on with.

    Args:
        segments: segments of a sentence.
        is_order: True if the first request is a thing or a number of things without a verb.

    Returns:
        `have` after `have the table cleaned and …`, `i want` after a wish, which may be a causative, too.
    """
    words = next((one.words for one in segments if one.mood is Mood.REQUEST), ())
    carried: tuple[Words, ...] = ()
    has_duty = any(english.DUTIES.starting(words, at) for at in range(1, len(words)))
    causative = english.CAUSATIVES.starting(words)
    if has_duty or causative:
        carried += (("have",),)
    is_wish = words[:2] in _WANTS or bool(english.WISHES.starting(words)) or is_order
    if (causative and causative[0] in ("i", "we")) or is_wish:
        carried += (("i", "want"),)
    return carried


_WANTS: Final = (("i", "want"), ("we", "want"), ("i", "need"), ("we", "need"))


def _stronger(link: Link, joint: str, other: Link, other_joint: str) -> tuple[Link, str]:
    return (other, other_joint) if link in (Link.START, Link.JOINED) else (link, joint)


def _begin_segment(tokens: Words, position: int) -> tuple[int, Mood, Words]:
    """Skip openers, and read the words of a prohibition or condition; return where its words start.

    Raises:
        InstructionError: a condition on time begins here.
    """
    before: Words = ()
    while True:
        opener = english.OPENERS.starting(tokens, position)
        if len(opener) == 1:
            _require_plain_opener(opener, before, tokens[position:])
        prohibition = english.PROHIBITIONS.starting(tokens, position)
        if prohibition[:1] == ("drop",) and _says_where_to(tokens[position + 1 :]):
            prohibition = ()  # `drop it on the left`
        if prohibition and len(prohibition) >= len(opener):
            start = position + len(prohibition)
            if tokens[start : start + 1] in _NOT_ALL:
                text = " ".join((*prohibition, tokens[start]))
                raise InstructionError(f"{quoted(text)} may ask for that, and for more; say what is wanted")
            while (opener := english.OPENERS.starting(tokens, start)) and opener != ("right",):
                start += len(opener)
            return start, Mood.PROHIBITION, prohibition
        if opener == ("both",) and english.is_plural("".join(tokens[position + 1 : position + 2])):
            opener = ()  # `both rooms` says how many
        causative = english.CAUSATIVES.starting(tokens, position)
        if causative[-1:] == ("that",) and len(causative) > len(opener):
            opener = ()  # `see to it that`
        is_side = opener == ("right",) and tokens[position + 1 : position + 2] not in _AFTER_RIGHT
        if opener and opener != tokens[position:] and not is_side:
            position, before = position + len(opener), opener
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


def _require_plain_opener(opener: Words, before: Words, tokens: Words) -> None:
    """Require that a word before a request changes nothing in it.

    Args:
        opener: the word.
        before: the opener before it.
        tokens: words and commas, from the opener on.

    Raises:
        InstructionError: it makes a question or statement of it, as in `do you wipe tables` and `people wipe
            tables`, or says that it is not wanted, as in `it is too late to wipe it`.
    """
    is_ability = tokens[2:3] in (("can",), ("could",), ("please",))  # `do you can wipe it`, as some ask
    if opener == ("do",) and tokens[1:2] == ("you",) and not is_ability:
        raise InstructionError(f"{quoted(' '.join(tokens))} asks something, and asks for nothing")
    is_address = tokens[1:2] in ((), (COMMA,)) or before in english.GREETINGS
    if english.GROUPS.issuperset(opener) and not is_address:
        raise InstructionError(f"{quoted(' '.join(tokens))} may say what people do")
    if opener == ("to",) and before and before[-1] not in _BEFORE_TO:
        raise InstructionError(f"{quoted(' '.join((*before, *opener)))} is not understood before a request")


_BEFORE_TO: Final = frozenset(
    {"also", "chance", "kindly", "minute", "moment", "now", "please", "then", "time"}
)
"""Words of openers after which `to` begins a request: `please to wipe it`, `if you have time to wipe it`."""
_NOT_ALL: Final = (("just",), ("merely",), ("only",), ("simply",))


def _says_where_to(rest: Words) -> bool:
    """Return True for `it on the left` and `the cup off at the right`."""
    clause = rest[: rest.index(COMMA)] if COMMA in rest else rest
    return rest[:1] == ("off",) or not english.TO_PLACES.isdisjoint(clause)


def _end_segment(tokens: Words, start: int, mood: Mood) -> tuple[int, Link, str]:
    """Find where a segment ends; return that, and link and joint of the next."""
    # `i feel like having tea`, `i would be glad if the table were clean`
    wish = max(len(one.starting(tokens, start)) for one in (english.WISHES, english.CAUSATIVES))
    begin = start + wish
    for at in range(begin, len(tokens)):
        if tokens[at] == COMMA:
            following = english.SEQUENCE.starting(tokens, at + 1)
            turned = english.REVERSED.starting(tokens, at + 1)
            if len(turned) > len(following):
                return at, Link.AFTER, " ".join((COMMA, *turned))
            if following:
                return at, _link_of(following), " ".join((COMMA, *following))
            return at, Link.JOINED, COMMA
        if at == start:
            continue
        if tokens[at : at + 2] in _NO_LINKS or tokens[at - 1 : at + 1] in _BY_THEN:
            continue  # `before anything else`, `next to the cup`
        if following := english.SEQUENCE.starting(tokens, at):
            if following == ("and",) and _is_afterwards(tokens, at + 1):
                return at, Link.THEN, "and after"
            return at, _link_of(following), " ".join(following)
        if mood is not Mood.CONDITION and (following := english.REVERSED.starting(tokens, at)):
            return at, Link.AFTER, " ".join(following)
        # `do the left half when cleaning`
        is_last = at + 2 == len(tokens) or tokens[at + 2 : at + 3] == (COMMA,)
        is_act = is_last and tokens[at] in english.ACT_MARKERS and english.is_gerund(tokens[at + 1])
        starts_adjunct = not is_act and (
            english.PROHIBITIONS.starting(tokens, at)
            or english.CONDITIONALS.starting(tokens, at)
            or english.TIME_CONDITIONALS.starting(tokens, at)
        )
        if starts_adjunct and mood is not Mood.CONDITION:
            return at, Link.ADJUNCT, ""
        if mood is Mood.PROHIBITION and tokens[at] == "just" and tokens[at + 1 : at + 2] not in _AFTER_JUST:
            return at, Link.JOINED, ""  # `don t make tea just wipe the table`
    return len(tokens), Link.START, ""


def _is_afterwards(tokens: Words, at: int) -> bool:
    """Return True for the `after` of `wipe the table and after bring the can`, which is `afterwards`."""
    word = "".join(tokens[at + 1 : at + 2])
    is_verb = word in english.MOVING_VERBS or english.OPENERS.starting(tokens, at + 1) in _ASKED
    return tokens[at : at + 1] == ("after",) and is_verb


_ASKED: Final = (("please",), ("you", "can"), ("you", "must"), ("you", "should"))
_AFTER_RIGHT: Final = tuple(
    (word,) for word in (COMMA, "can", "could", "i", "let", "please", "so", "we", "would")
)
_NO_LINKS: Final = (("before", "anything"), ("before", "then"), ("next", "to"))
_BY_THEN: Final = (("by", "then"), ("before", "then"))
_AFTER_JUST: Final = ((), ("because",), ("for",), ("in",), ("now",), ("to",), ("yet",))


def _link_of(joint: Words) -> Link:
    return Link.JOINED if joint in _ADDITIONS else Link.THEN


_ADDITIONS: Final = tuple(
    tuple(text.split()) for text in ("and", "plus", "as well as", "along with", "and along with")
)


def strip_ends(tokens: Words) -> Words:
    """Remove what asks for nothing at the end, also after a comma, as in `…, will you?`.

    Args:
        tokens: words and commas.

    Returns:
        The rest.
    """
    while (shorter := strip_closers(tokens)) != tokens or tokens[-1:] == (COMMA,):
        tokens = shorter if shorter[-1:] != (COMMA,) else shorter[:-1]
    return tokens


def strip_openers(tokens: Words) -> Words:
    """Remove phrases that ask for nothing at the start.

    Args:
        tokens: words and commas.

    Returns:
        The rest.
    """
    position = 0
    while opener := english.OPENERS.starting(tokens, position):
        position += len(opener)
    return tokens[position:]


_OPEN: Final = frozenset(
    {
        "a",
        "an",
        "before",
        "by",
        "for",
        "from",
        "her",
        "his",
        "into",
        "my",
        "of",
        "onto",
        "our",
        "the",
        "their",
        "to",
        "with",
        "your",
    }
)
"""Words that go on: what stands behind one is no phrase of its own."""


def strip_closers(words: Words) -> Words:
    """Remove phrases that ask for nothing at the end.

    Args:
        words: words and commas.

    Returns:
        The rest.
    """
    while words:
        closer = english.CLOSERS.ending(words)
        before = words[: len(words) - len(closer)][-1:]
        if not closer or (before and before[0] in _OPEN):
            return words  # `bring it to the chef`
        words = words[: -len(closer)]
    return words
