"""Things that reasons name, and that a pronoun behind them stands for: `the floor is dirty, so clean it`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from aeros.agent.instructions import english
from aeros.agent.instructions.arguments import are_of_one_object, is_object
from aeros.agent.instructions.coverage import Coverage
from aeros.agent.instructions.covering import cover
from aeros.agent.instructions.lexicon import TaskPhrases
from aeros.agent.instructions.meaning import Errand
from aeros.agent.instructions.phrases import Words
from aeros.agent.instructions.segments import Link, Segment


def named_before(
    errands: Sequence[Errand], reasons: Sequence[Segment], tasks: Sequence[TaskPhrases]
) -> list[Errand]:
    """Find the requests that `it` may mean the object of.

    After a reason such as `the floor is dirty, so …`, `it` is what the reason names. After `otherwise …` it
    is not certain which of two objects it is.

    Args:
        errands: the requests before.
        reasons: the reasons before, from the same sentence or from those that lead it.
        tasks: all tasks.

    Returns:
        The requests, the last one first of all; none if it is not certain.
    """
    leading = [reason for reason in reasons if reason.link is not Link.ADJUNCT]
    # `I can't reach the can, could you get it?`: before all requests, a remark says what `it` is, too.
    leading = leading or [one for one in reasons if not errands and _names_plainly(one.words)]
    if leading and not _OTHERS.isdisjoint(leading[-1].words):
        return []  # `I hate the other table, clean it`
    if not leading:
        return [] if errands and errands[-1].is_otherwise else list(errands)
    words = _without_verbs(leading[-1].words)
    named = _named(words, tasks)
    if len(named) > 1 and not are_of_one_object([one.routed for one in named]):
        return []
    earlier = [one for reason in leading[:-1] for one in _named(_without_verbs(reason.words), tasks)]
    if any(_is_other_thing(one, other) for one in named for other in earlier):
        return []  # `there is a cup, there is a block: bring it`
    if any(_is_unclear(words, phrase, one) for one in named for phrase in one.objects):
        return []
    # Of several tasks with the named object, the one that knows the part that is named.
    return [Errand(one.routed) for one in sorted(named, key=lambda one: len(one.values.stated))[-1:]]


def _named(words: Words, tasks: Sequence[TaskPhrases]) -> list[Coverage]:
    """Return how those tasks cover the words whose objects the words name."""
    coverages = [cover(entry, words, knows_pronoun=False) for entry in tasks]
    return [one for one in coverages if one.objects and not one.values.fault]


def _is_other_thing(one: Coverage, other: Coverage) -> bool:
    is_same_task = one.entry is other.entry and one.values.is_specific and other.values.is_specific
    return is_same_task and one.values.stated != other.values.stated


def _is_unclear(words: Words, thing: Words, coverage: Coverage) -> bool:
    """Return True if `it` may be something else than a thing that a reason names."""
    is_carried = any(map(is_object, coverage.routed.task.parameters.values()))
    if is_carried and not coverage.values.is_specific:
        return True  # `the things are here`
    return any(
        _is_of_somebody(words, at + len(thing))
        or _is_one_of_several(words, at)
        or _says_where_another_is(words, at, is_carried=is_carried)
        or _is_with_another(words, at, at + len(thing))
        for at in range(len(words))
        if words[at : at + len(thing)] == thing
    )


def _is_of_somebody(words: Words, end: int) -> bool:
    """Return True for the table of `the table of Anna is dirty`."""
    return words[end : end + 1] == ("of",) and english.DETERMINERS.isdisjoint(words[end + 1 : end + 2])


def _is_one_of_several(words: Words, at: int) -> bool:
    """Return True for the table of `one table is dirty` and `some tables are dirty`."""
    before = words[at - 1] if at else ""
    return before in _PARTIAL or before in english.EACH_DETERMINERS or english.number_of(before) is not None


def _says_where_another_is(words: Words, at: int, *, is_carried: bool) -> bool:
    """Return True if a thing only says where another one is: `the lamp by the table`, `the lid of it`."""
    start = _start(words, at)
    before = words[start - 1] if start else ""
    if before in _NEAR or words[max(start - 2, 0) : start] in _NEAR_TO:
        return True
    # A verb before it says that the thing is no part of the subject, as in `we sit at the table`.
    is_of_subject = words[0] in _ARTICLES and _VERBS.isdisjoint(words[:start])
    if before in _PREPOSITIONS - {"on", "of"} and is_of_subject:
        return True
    is_of_noun = start > 2 and words[start - 3] in _ARTICLES
    return is_carried and (before in _OF or (before in _PREPOSITIONS and is_of_noun))


def _is_with_another(words: Words, at: int, end: int) -> bool:
    """Return True for the table of `the table and the floor are dirty`."""
    if words[end : end + 1] == ("and",) and words[end + 1 : end + 2] and words[end + 1] in _ARTICLES:
        return True
    start = _start(words, at)
    # In `we have guests and the table is dirty`, it is the subject of its own clause.
    has_own_verb = not _VERBS.isdisjoint(words[:start]) and words[end:] != ()
    return start > 1 and words[start - 1] == "and" and not has_own_verb


def _start(words: Words, at: int) -> int:
    """Return the place of the article of the thing that begins at a place, before its adjectives."""
    return next(_articles(words, at), at)


def _articles(words: Words, at: int) -> Iterator[int]:
    return (one for one in range(at - 1, max(at - 4, -1), -1) if words[one] in _ARTICLES)


def _names_plainly(words: Words) -> bool:
    """Return True if speakers say something of a thing, and not whose or where it is, or which of several."""
    return words[:1] in _SPEAKERS[:2] and _OF_OTHERS.isdisjoint(words)


def _without_verbs(words: Words) -> Words:
    """Leave out the verbs of `he left crumbs on the table` and `we can reach it`: no side, and no thing."""
    before = english.DETERMINERS | english.POSSESSIVES | english.TO_PLACES | {"s"}
    return tuple(
        word
        for at, word in enumerate(words)
        if word != "left" or at == 0 or words[at - 1] in before or words[at + 1 : at + 2] in _PLACE_NOUNS
        if word != "can" or not (words[at - 1 : at] in _SPEAKERS or words[at + 1 : at + 2] == ("t",))
    )


_ARTICLES: Final = english.DETERMINERS | english.POSSESSIVES
_VERBS: Final = english.FINITE | english.FINITE_OF_PERSONS | english.MODALS
_PARTIAL: Final = frozenset({"any", "no", "some"})
_NEAR: Final = frozenset(
    {"above", "against", "behind", "below", "beneath", "beside", "between", "by", "near", "opposite", "under"}
)
"""Prepositions that say of a thing where another one is."""
_NEAR_TO: Final = (("next", "to"), ("front", "of"), ("close", "to"))
_OF: Final = frozenset({"at", "in", "inside", "into", "of", "off", "on", "onto", "to"})
_PREPOSITIONS: Final = _OF | {"around", "for", "from", "over", "with"}
_OTHERS: Final = frozenset({"another", "different", "downstairs", "other", "outdoors", "second", "upstairs"})
_OF_OTHERS: Final = english.POSSESSIVES | english.PLACES | {"my", "of", "other", "our", "s", "your"}
_SPEAKERS: Final = (("i",), ("we",), ("he",), ("she",), ("they",))
_PLACE_NOUNS: Final = tuple((word,) for word in english.PLACE_NOUNS)
