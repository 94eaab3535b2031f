"""The nearest words that the grammar understands, for an instruction that it refuses.

They are the user's own words without one phrase of them, and without words that nothing declares. A phrase
that may turn the meaning round is not left out: a negation, a condition, a choice, a question, a number, or
a value of a parameter, such as a colour; but a clause that tells of a person or a place may be, as in `…, I
have done the left`. If two different meanings are as near, there is none.

It is only a proposal, as what was left out may have been meant. An operator confirms it, with the phrase that
is left out before their eyes; a script is refused, and names it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

from aeros.agent.instructions import english
from aeros.agent.instructions.lexicon import TaskPhrases, task_phrases
from aeros.agent.instructions.meaning import Understanding
from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.spelling import unknown_words
from aeros.agent.instructions.understand import understand
from aeros.spec.diagnostics.codes import quoted
from aeros.spec.diagnostics.words import normalized_words
from aeros.spec.model.ecm import Ecm

_LONGEST_PHRASE: Final = 5
"""Greatest number of words and marks of the phrase that is left out."""

_MOST_TRIES: Final = 100
"""Greatest number of texts that are tried for one instruction."""

_TOKEN: Final = re.compile(r"[^\W_]+(?:['’-][^\W_]+)*|[^\w\s]")

_KEPT_PHRASES: Final = (
    english.PROHIBITIONS,
    english.CONDITIONALS,
    english.TIME_CONDITIONALS,
    english.OTHERWISE,
    english.LEFT_ALONE,
    english.NEGATIVE_DUTIES,
    english.CORRECTIONS,
)
_KEPT_WORDS: Final = (
    english.NEGATIVES
    | english.CHOICES
    | english.QUESTIONS
    | english.MODALS
    | english.REPETITIONS
    | english.UNIVERSAL
)
"""Words that may turn the meaning round."""


@dataclass(frozen=True, slots=True)
class NearestReading:
    """The nearest words that the grammar understands.

    Attributes:
        meaning: their meaning; its instruction is these words.
        left_out: the user's words that are not among them.
    """

    meaning: Understanding
    left_out: str


class NearlyUnderstoodError(InstructionError):
    """An instruction that is not understood whole, but without a phrase of it.

    Args:
        refusal: the reason why it is not understood.
        nearest: its nearest words that are.
    """

    def __init__(self, refusal: InstructionError, nearest: NearestReading) -> None:
        super().__init__(
            f"{refusal.reason}; without {quoted(nearest.left_out)}, it would be understood as "
            f"{'; '.join(nearest.meaning.formal_lines)}"
        )
        self.refusal = refusal
        self.nearest = nearest


def nearest_reading(instruction: str, modules: Mapping[str, Ecm]) -> NearestReading | None:
    """Find the nearest words that the grammar understands, for an instruction that it refuses.

    Args:
        instruction: words of the user.
        modules: active modules by id.

    Returns:
        The reading; None if nothing near is understood, or several meanings are as near.
    """
    tokens = tuple(_TOKEN.findall(instruction))
    found: dict[tuple[str, ...], NearestReading] = {}
    number_left_out = len(tokens)
    for left_out in _candidates(tokens, task_phrases(modules))[:_MOST_TRIES]:
        if found and len(left_out) > number_left_out:
            break
        text = _joined(token for at, token in enumerate(tokens) if at not in left_out)
        try:
            meaning = understand(text, modules)
        except InstructionError:
            continue
        number_left_out = len(left_out)
        words = " … ".join(_joined(tokens[at] for at in run) for run in _runs(left_out))
        found.setdefault(meaning.formal_lines, NearestReading(meaning, words))
    return next(iter(found.values())) if len(found) == 1 else None


def _kept_words(tokens: Sequence[str], tasks: Sequence[TaskPhrases]) -> frozenset[str]:
    """Return the words that are in no phrase that is left out."""
    spoken = tuple(word for token in tokens for word in normalized_words(token))
    of_phrases = (
        word
        for at in range(len(spoken))
        for phrases in _KEPT_PHRASES
        for word in phrases.starting(spoken, at)
    )
    numbers = (word for word in spoken if english.number_of(word) is not None and word not in _ARTICLES)
    stated = (
        word
        for entry in tasks
        for parameter in entry.routed.task.parameters.values()
        for phrases in parameter.phrases.values()
        for phrase in phrases
        for word in normalized_words(phrase)
    )
    things = (word for entry in tasks for phrase in entry.objects for word in phrase)
    kept = _KEPT_WORDS.union(of_phrases, numbers, stated, things) - english.DETERMINERS
    # `can you …` asks for no can.
    asked = {one for one, other in pairwise(spoken) if one in _ABILITY and other in _ADDRESSED}
    return frozenset(kept - asked)


_ARTICLES: Final = frozenset({"a", "an"})
_PAUSES: Final = frozenset(",;:.!?")
_SMALL_WORDS: Final = (
    english.POSITIONS
    | english.DIRECTIONS
    | english.PARTICLES
    | english.DETERMINERS
    | english.PRONOUNS
    | english.DEGREES
    | english.FILLERS
    | english.PERSONS
    | {"and", "as", "first", "last", "him", "her", "me", "my", "us", "with"}
)
"""Words of which the loss alone would make another sentence."""

_ABILITY: Final = frozenset({"can", "could", "may"})
_ADDRESSED: Final = frozenset({"i", "we", "you", "u"})
_CLAUSE_STARTS: Final = english.PERSONS | {"i", "we", "he", "she", "they", "where", "while"}
"""First words of a clause that says something, and asks for nothing."""


def _candidates(tokens: Sequence[str], tasks: Sequence[TaskPhrases]) -> list[frozenset[int]]:
    """Return the places of tokens that may be left out, the fewest first.

    They are the words that nothing declares, and one phrase or clause. They say something: without `off`
    alone, the rest would say another thing.
    """
    kept = _kept_words(tokens, tasks)
    is_kept = tuple(not kept.isdisjoint(normalized_words(token)) for token in tokens)
    unknown = frozenset(
        at
        for at, token in enumerate(tokens)
        if not is_kept[at] and not set(unknown_words(token, tasks)).isdisjoint(normalized_words(token))
    )
    others = [at for at in range(len(tokens)) if at not in unknown]
    phrases = (
        others[start : start + length]
        for length in range(_LONGEST_PHRASE + 1)
        for start in range(len(others) - length + 1)
    )
    says_something = tuple(not _SMALL_WORDS.issuperset(normalized_words(token)) for token in tokens)
    found = {unknown.union(phrase) for phrase in phrases if not any(is_kept[at] for at in phrase)}
    found = {one for one in found if any(says_something[at] for at in one)}
    found |= {unknown.union(clause) for clause in _clauses(tokens)}
    return sorted(found, key=lambda places: (len(places), sorted(places)))


def _clauses(tokens: Sequence[str]) -> Iterator[range]:
    """Yield each clause about a person or a place, up to a pause: `I have done the left`, `where it is`."""
    for start, token in enumerate(tokens):
        if normalized_words(token)[:1] and normalized_words(token)[0] in _CLAUSE_STARTS:
            marks = (at for at in range(start, len(tokens)) if tokens[at] in _PAUSES)
            end = next(marks, len(tokens))
            yield range(start - (start > 0 and tokens[start - 1] in _PAUSES), end)


def _runs(places: frozenset[int]) -> Iterator[range]:
    """Yield the ranges of places that follow each other."""
    for start in sorted(at for at in places if at - 1 not in places):
        end = start
        while end in places:
            end += 1
        yield range(start, end)


def _joined(tokens: Iterator[str]) -> str:
    """Join tokens with spaces, but for none before a mark."""
    return re.sub(r" (?=[^\w\s])", "", " ".join(tokens))
