"""Reasons and statements of an instruction, which ask for nothing: `because guests are coming`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Final

from aeros.agent.instructions import english
from aeros.agent.instructions.arguments import counted_parameter
from aeros.agent.instructions.conditions import find_condition
from aeros.agent.instructions.covering import cover
from aeros.agent.instructions.lexicon import TaskPhrases
from aeros.agent.instructions.phrases import Words
from aeros.agent.instructions.reasons.statements import is_remark
from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.segments import Link, Mood, Segment, Sentence
from aeros.agent.planning.routing import RoutedTask
from aeros.spec.diagnostics.codes import quoted
from aeros.spec.expr import terms as t


def without_statements(sentence: Sentence, tasks: Sequence[TaskPhrases]) -> tuple[Sentence, list[Segment]]:
    """Take out the reasons, and statements of a condition that a task declares: `the table is dirty`.

    Args:
        sentence: the segments of a sentence.
        tasks: all tasks.

    Returns:
        The other segments, and the reasons.
    """
    kept: list[Segment] = []
    reasons: list[Segment] = []
    for segment in sentence:
        is_stated = (
            segment.mood is Mood.REQUEST
            and not segment.openers
            and len(segment.words) > 1
            and english.MODALS.isdisjoint(segment.words)
            and any(
                find_condition(one, entry, is_own=bool(kept)) is not None
                for entry in tasks
                for one in (segment, replace(segment, words=("there", "is", *segment.words)))
            )
        )
        (reasons if is_stated or segment.mood is Mood.REASON else kept).append(segment)
    return tuple(kept), reasons


def is_topic(sentence: Sentence, following: Sentence, tasks: Sequence[TaskPhrases]) -> bool:
    """Check if a sentence only names what the next one is about: `the table! clean it!`.

    Args:
        sentence: the segments of the sentence.
        following: those of the next one.
        tasks: all tasks.

    Returns:
        True if it names one object and no number, and the next sentence has a pronoun for it.
    """
    if len(sentence) != 1 or sentence[0].mood is not Mood.REQUEST or not following:
        return False
    if following[0].mood is not Mood.REQUEST or english.PRONOUNS.isdisjoint(following[0].words):
        return False
    found = [cover(entry, sentence[0].words, knows_pronoun=False) for entry in tasks]
    alone = [one for one in found if one.is_object_alone]
    says_more = any(one.values.numbers or one.values.names_place or one.names_pronoun for one in alone)
    return bool(alone) and not says_more


def require_plain_reason(
    reason: Segment, tasks: Sequence[TaskPhrases], asked_for: Sequence[RoutedTask]
) -> None:
    """Require that a reason can only be one.

    Args:
        reason: the reason.
        tasks: all tasks.
        asked_for: tasks that the instruction asks for.

    Raises:
        InstructionError: it holds a condition or a negation, or asks for a task.
    """
    words = reason.words
    if (not _SPEECH.isdisjoint(words) or words[-1:] == ("goes",)) and not is_remark(words):
        raise InstructionError(f"{quoted(' '.join((*reason.marker, *words)))} may report what others say")
    if not is_remark(words) and _has_second_predicate(words):
        raise InstructionError(f"{quoted(' '.join((*reason.marker, *words)))} may say more than a reason")
    _require_agreement(reason, tasks, asked_for)
    is_stated = is_remark(words) or any(find_condition(reason, entry) is not None for entry in tasks)
    speaks_of_people = words[:1] in (("i",), ("we",), ("he",), ("she",), ("they",))
    refused = english.CHOICES | english.REPETITIONS | english.TURNS
    named = {word for entry in tasks for phrase in entry.objects for word in phrase}
    named |= {word for entry in tasks for value in entry.values for word in value.words}
    named -= english.DETERMINERS | english.TO_PLACES | english.PART_PREPOSITIONS
    # `the customers from town arrive at ten` speaks of no thing that the robot could be asked for.
    is_elsewhere = named.isdisjoint(words)
    refused |= frozenset() if reason.link is Link.ADJUNCT or is_elsewhere else english.PLACES
    is_free = speaks_of_people or (is_elsewhere and reason.link is Link.START and not reason.marker[:-1])
    refused |= frozenset() if is_free else english.NEGATIVES
    doubtful = [
        word
        for at, word in enumerate(words)
        if word in refused and not is_stated
        if not _is_known_place(words[at:], tasks, asked_for)
        and not _is_known_part(words[at:], tasks, asked_for)
    ]
    asked = [
        entry.routed
        for entry in tasks
        if (found := cover(entry, words, knows_pronoun=False)).triggers and found.objects
        if not is_stated and not any(entry.routed.covers(one) for one in asked_for)
    ]
    if doubtful or asked:
        why = quoted(doubtful[0]) if doubtful else f"`{asked[0]}`"
        text = " ".join((*reason.marker, *words))
        raise InstructionError(f"it is not clear if {quoted(text)} is only a reason, because of {why}")


def _has_second_predicate(words: Words) -> bool:
    """Return True for `it is dirty was a joke` and `we can eat is what he does`: more than a reason."""
    finite = english.FINITE | english.MODALS
    verbs = [at for at, word in enumerate(words) if word in finite and words[at - 1 : at] not in _OF_VERBS]
    for first, second in pairwise(verbs):
        between = words[first + 1 : second]
        is_of_noun = bool(between) and _NEW_SUBJECT.isdisjoint(between)
        if words[second] in _COPULAS and (is_of_noun or words[second + 1 : second + 2] in _WHAT):
            return True
    return False


_COPULAS: Final = frozenset({"is", "are", "was", "were", "would", "has", "had"})
_OF_VERBS: Final = tuple((word,) for word in sorted(english.MODALS | {"and", "or"}))
_NEW_SUBJECT: Final = (
    english.DETERMINERS
    | english.POSSESSIVES
    | english.SUBJECTS
    | english.PRONOUNS
    | {"and", "as", "because", "but", "or", "since", "so", "what", "which", "who", "you", ","}
)
_WHAT: Final = (("what",), ("how",), ("when",), ("why",))


def _plain_term(term: t.Term) -> t.Term:
    """Return `p` for `not (not p)`: `it is not needed`."""
    if isinstance(term, t.Not) and isinstance(term.operand, t.Not):
        return term.operand.operand
    return term


_SPEECH: Final = frozenset({"claims", "quote", "said", "say", "says", "sing", "sings", "tells"})


def _is_known_part(words: Words, tasks: Sequence[TaskPhrases], asked_for: Sequence[RoutedTask]) -> bool:
    """Return True for `on the left half …` if that half is asked for."""
    begin = next((at for at in range(1, len(words)) if words[at] not in english.DETERMINERS), 0)
    values = [(entry, entry.value_phrase(words, begin)) for entry in tasks]
    return words[0] in english.POSITIONS and any(
        value is not None and one.arguments.get(value.parameter) in value.values
        for entry, value in values
        for one in asked_for
        if entry.routed.covers(one)
    )


def _require_agreement(
    reason: Segment, tasks: Sequence[TaskPhrases], asked_for: Sequence[RoutedTask]
) -> None:
    """Require that a reason neither says that a goal is reached, nor a number or colour of what is asked for.

    Raises:
        InstructionError: it does, as in `the table is clean, wipe it` and `there are five of us, make tea`.
    """
    text = quoted(" ".join((*reason.marker, *reason.words)))
    for entry in tasks:
        for routed in (one for one in asked_for if entry.routed.covers(one)):
            found = find_condition(_of_whole(reason, entry, routed), entry, is_own=True)
            goal = routed.task.goal
            conjuncts = goal.operands if isinstance(goal, t.And) else (goal,)
            term = None if found is None else _plain_term(found.term)
            if term in conjuncts:
                raise InstructionError(f"{text} says that the goal of `{routed}` is reached")
            # `the table is not a mess`; `the table is not clean` denies the goal itself
            denies = isinstance(term, t.Not) and not english.NEGATIVES.isdisjoint(reason.words)
            if denies and isinstance(term, t.Not) and term.operand not in conjuncts:
                raise InstructionError(f"{text} may say that `{routed}` is not needed")
            act = cover(entry, reason.words, knows_pronoun=True, is_perfect=True).triggers
            if (
                act
                and reason.link is Link.ADJUNCT
                and not reason.marker
                and reason.words[0] in english.PLACES | _IT
            ):
                raise InstructionError(f"{text} may say that `{routed}` is done already")
            counted = counted_parameter(routed.task)
            is_default = counted is not None and routed.arguments[counted.name] == counted.default
            if is_default and any(_says_how_many(reason.words, at) for at in range(len(reason.words))):
                raise InstructionError(f"{text} may say how many are wanted; say the number in the request")
            named = cover(entry, reason.words, knows_pronoun=False).values
            colours = english.COLOURS.intersection(reason.words) - {
                word for value in entry.values if value.names_object for word in value.words
            }
            if named.is_specific and colours:
                raise InstructionError(f"{text} says a colour that `{routed}` does not know")


def _of_whole(reason: Segment, entry: TaskPhrases, routed: RoutedTask) -> Segment:
    """Return `the table is clean` for the reason `the left half is clean` if that half is asked for."""
    words = reason.words
    for at in range(len(words) if entry.objects and not reason.marker else 0):
        value = entry.value_phrase(words, at)
        if value is not None and value.is_place and value.values == {routed.arguments.get(value.parameter)}:
            rest = words[at + len(value.words) :]
            noun = () if rest[:1] == ("of",) else entry.objects[0]
            return replace(reason, words=words[:at] + noun + (rest if noun else rest[2:]))
    return reason


_IT: Final = frozenset({"it", "they", "this", "the"})


def _says_how_many(words: Words, at: int) -> bool:
    """Return True at the number of `we are six`; `at eight` is a time."""
    number = english.number_of(words[at])
    is_time = at > 0 and words[at - 1] in ("at", "by", "in", "until", "since")
    return number is not None and number > 1 and not is_time


def _is_known_place(words: Words, tasks: Sequence[TaskPhrases], asked_for: Sequence[RoutedTask]) -> bool:
    """Return True for `on the stand` if the task that is asked for finds its object there in any case."""
    place = tuple(word for word in words[1:] if word not in english.DETERMINERS)
    known = {
        tuple(word for word in phrase if word not in english.DETERMINERS | english.POSITIONS)
        for entry in tasks
        if any(entry.routed.covers(one) for one in asked_for)
        for phrase in (*entry.objects, *entry.extras)
        if phrase in entry.objects or phrase[0] in english.POSITIONS
    }
    is_known = any(place[: len(one)] == one and set(place[len(one) :]) <= _EARLIER for one in known if one)
    return words[0] in english.POSITIONS and is_known


_EARLIER: Final = frozenset({"again", "already", "earlier", "today", "yesterday"})
"""Words that a reason may end with."""


def require_no_retraction(
    reasons: Sequence[Segment], tasks: Sequence[TaskPhrases], asked_for: Sequence[RoutedTask]
) -> None:
    """Require that no statement after a request may take it back, as `i changed my mind` does.

    Args:
        reasons: reasons and statements of a later sentence.
        tasks: all tasks.
        asked_for: tasks that are asked for before.

    Raises:
        InstructionError: one is a statement, neither about people nor of a condition that a task declares.
    """
    for one in reasons:
        is_marked = one.marker or is_remark(one.words)
        # `fetch the cup. It is not needed.`: only of what is asked for, `it` says a condition of it.
        is_stated = any(
            find_condition(one, entry, is_own=any(entry.routed.covers(asked) for asked in asked_for))
            for entry in tasks
        )
        if not is_marked and not is_stated:
            raise InstructionError(
                f"{quoted(one.text)} may take back what is asked for before it; say reasons first, or with "
                "`because`"
            )
