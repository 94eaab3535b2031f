"""Statements before a request, which ask for nothing: `we spilled some juice, please wipe the table`.

A statement has a subject and a finite verb. It wishes for nothing, reports no words of others, and is not
about words: after `my mother says` or `the plan is this`, a request may be somebody else's.
"""

from __future__ import annotations

from typing import Final

from aeros.agent.instructions import english
from aeros.agent.instructions.phrases import Words

_SHORT_CAUSATIVE: Final = 3
"""Words of the causatives that may begin a statement, too, as `i need` may."""

_SPEAKERS: Final = frozenset({"i", "we"})
_PERSONS: Final = frozenset({"i", "we", "he", "she", "they", "everyone", "everybody", "someone", "somebody"})
_THINGS: Final = frozenset({"it", "this", "that", "there", "these", "those"})
_WISHING: Final = frozenset({"want", "wants", "like", "likes", "wish", "wishes", "love", "loves"})
_OWN_ACTS: Final = frozenset({"see", "watch", "visit", "eat", "meet", "come", "know", "sit", "work"})
_OWN_MODALS: Final = frozenset({"can", "cannot", "could", "must", "should", "to", "will", "ll"})
"""Modals by which speakers say what they are to do themselves: `i must leave soon`."""
_FUTURE: Final = frozenset({"will", "ll"})


_WHICH_ONE: Final = english.COLOURS | frozenset(
    {"left", "right", "middle", "centre", "center", "half", "halves", "part", "side", "sides"}
)
"""Words of a remark that may say which thing or part is meant."""


def is_remark(words: Words) -> bool:
    """Check if some words ask for nothing even after a request: they cannot take it back.

    Args:
        words: words between two pauses.

    Returns:
        True for a declared remark, and for what people are, have or do without a word that may be about the
        request: `my guests are about to arrive`, and not `i did it` or `she says`.
    """
    if not _WHICH_ONE.isdisjoint(words):
        return False
    is_of_body = words[:1] in (("my",), ("our",)) and words[1:2] and words[1] in english.BODY
    if is_free_remark(words) or (is_of_body and english.NO_STATEMENTS.isdisjoint(words)):
        return len(words) > 1 or is_free_remark(words)
    words = _without_openers(words)
    names_person = words[:1] in _PERSON_SUBJECTS or (
        words[:1]
        and words[0] in english.DETERMINERS | english.POSSESSIVES
        and not english.PERSONS.isdisjoint(words[1:4])
    )
    barred = english.BARRED_IN_REMARKS - _TO
    if not names_person and words[:1]:
        # `it is the one in the fridge` may say which thing is meant.
        barred |= english.PLACES | english.TO_PLACES | {"for"}
        if words[0] in _THINGS and any(one in english.DETERMINERS for one in words[1:3]):
            return False
        words = words if words[0] not in _THINGS else ("there", *words[1:])
    is_full = len(words) > _MIN_REMARK and barred.isdisjoint(words) and words[-1] not in _SPEECH
    return is_full and is_statement(words)


def is_free_remark(words: Words) -> bool:
    """Check if some words are a remark that may stand anywhere, and name no side, part or colour.

    Args:
        words: words between two pauses.

    Returns:
        True for `i love my guests`, and not for `i hate people at the left half`, which may say which part.
    """
    return words in english.FREE_REMARKS and _WHICH_ONE.isdisjoint(words)


def _without_openers(words: Words) -> Words:
    while opener := english.STATEMENT_OPENERS.starting(words):
        words = words[len(opener) :]
    return words


_PERSON_SUBJECTS: Final = (
    ("i",),
    ("we",),
    ("they",),
    ("he",),
    ("she",),
    ("everyone",),
    ("everybody",),
    ("people",),
)
_TO: Final = frozenset({"to"})
_MIN_REMARK: Final = 2
"""Words that a remark about people has more than: `she laughs` may report a speech."""
_SPEECH: Final = frozenset(
    {
        "barked",
        "called",
        "cried",
        "full",
        "go",
        "goes",
        "like",
        "screamed",
        "shouted",
        "went",
        "was",
        "is",
        "yelled",
    }
)
"""Last words of a statement after which a speech may follow, as in `she goes, …`."""


def is_statement(words: Words) -> bool:
    """Check if some words state something and ask for nothing.

    Args:
        words: words up to a comma or the end of a sentence.

    Returns:
        True if they begin with a subject that has a finite verb.
    """
    words = _without_openers(words)
    if words[1:2] == ("and",) and words[0] in english.PERSONS and words[2:3] and words[2] in english.PERSONS:
        words = words[2:]  # `grandma and grandpa are here`
    if len(words) < 2 or not english.NO_STATEMENTS.isdisjoint(words) or words[-1] in _SPEECH:
        return False
    if english.PROHIBITIONS.starting(words) or english.WISHES.starting(words):
        return False
    if english.WISH_ENDS.ending(words) and any(map(english.is_act_noun, words)):
        return False  # `the wiping of the table is requested`
    if any(english.NEGATIVE_DUTIES.starting(words, at) for at in range(1, len(words))):
        return False
    if len(english.CAUSATIVES.starting(words)) > _SHORT_CAUSATIVE:
        return False  # `it is high time the table was cleaned`
    if words[0] == "do" or words[0] in english.FILLERS:
        return False  # `please have it cleaned`, `do have a look`
    first, second = words[0], words[1]
    rest = frozenset(
        word
        for at, word in enumerate(words)
        if at and not _is_can(words, at) and not (word == "to" and words[at - 1] in _BEFORE_TO)
    )
    if first in _SPEAKERS and not (english.DESIRES - _FUTURE).isdisjoint(words[1:5]):
        return False
    is_request = len(english.OPENERS.starting(words)) > _SHORT_CAUSATIVE
    if is_request or english.COUNTED_WISHES.starting(words) or words[-1] == "to":
        return False
    if first in english.DETERMINERS | english.POSSESSIVES and _is_wish_of_others(words):
        return True
    if first in _SPEAKERS and second not in english.DETERMINERS and rest & english.MODALS <= _OWN_MODALS:
        return True
    if rest & english.MODALS and not (first not in _SPEAKERS | _THINGS and rest & english.MODALS <= _FUTURE):
        # `i can't reach it` states something
        return first in _SPEAKERS and (second == "cannot" or words[1:3] in (("can", "t"), ("could", "t")))
    if first in _PERSONS:
        return second not in english.DETERMINERS
    if first in _THINGS and (second in english.FINITE or first not in english.DETERMINERS):
        return second in english.FINITE
    if first in english.DETERMINERS | english.POSSESSIVES:
        verbs = frozenset(words[2:])
        is_past = any(len(word) > 4 and word.endswith("ed") for word in verbs)
        acts = is_past or not english.FINITE_OF_PERSONS.isdisjoint(verbs)
        is_person = not english.PERSONS.isdisjoint(words[1:3])
        return not english.FINITE.isdisjoint(verbs) or (is_person and acts)
    return first not in english.QUESTIONS and (
        (second in english.FINITE and (second != "s" or first in english.PERSONS or _is_contracted(words)))
        or (first in english.PERSONS and second in english.FINITE_OF_PERSONS)
    )


def _is_contracted(words: Words) -> bool:
    """Return True for the `is` of `lunch's nearly ready`; `the table's left half` is a part."""
    is_adverb = words[2:3] and (words[2] in english.FILLERS | english.DEGREES or words[2].endswith("ly"))
    return bool(is_adverb or words[2:3] in _STATES) and _WHICH_ONE.isdisjoint(words)


_STATES: Final = tuple(
    (word,) for word in ("almost", "free", "full", "late", "not", "on", "over", "ready", "soon")
)
_BEFORE_TO: Final = frozenset(
    {
        "about",
        "back",
        "close",
        "come",
        "coming",
        "due",
        "get",
        "getting",
        "got",
        "going",
        "here",
        "next",
        "over",
        "ready",
        "round",
        "thanks",
        "trying",
        "unable",
        "used",
        "way",
    }
)
"""Words after which `to` tells of nothing that is to be done."""


def _is_can(words: Words, at: int) -> bool:
    """Return True for the noun `can`."""
    after = words[at + 1 : at + 2]
    is_place = bool(after) and after[0] in english.POSITIONS
    return words[at] == "can" and (not after or is_place or after[0] in english.FINITE)


def _is_wish_of_others(words: Words) -> bool:
    """Return True for `the team wants to see the process`, which asks the robot for nothing."""
    verb = next((at for at, word in enumerate(words) if word in _WISHING), 0)
    is_own_act = words[verb + 1 : verb + 2] == ("to",) and not _OWN_ACTS.isdisjoint(
        words[verb + 2 : verb + 3]
    )
    return bool(verb) and is_own_act and not english.PERSONS.isdisjoint(words[1:verb])
