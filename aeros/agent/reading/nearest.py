"""The nearest words that the grammar understands, for an instruction that it refuses.

They are the user's own words without one phrase of them, and without words that nothing declares. Words that
may turn the meaning round are not left out: a negation, an exception, a condition with all its words, a
choice, a question, a number, a time, a colour, a value of a parameter, or a word right before an act, as in
`prevent cleaning …`. A clause that tells of a person or a place may be left out, if it has none of these; a
value is allowed in one that reports, as in `…, I have done the left`. If two different meanings are as near,
there is none.

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

_LONGEST_INSTRUCTION: Final = 200
"""Greatest number of words and marks of an instruction that is tried; an operator reads no longer one."""

_TOKEN: Final = re.compile(r"[^\W_]+(?:['’-][^\W_]+)*|[^\w\s]")

_KEPT_PHRASES: Final = (
    english.PROHIBITIONS,
    english.CONDITIONALS,
    english.TIME_CONDITIONALS,
    english.OTHERWISE,
    english.LEFT_ALONE,
    english.NEGATIVE_DUTIES,
    english.CORRECTIONS,
    english.WITHDRAWALS,
    english.DENIALS,
)
_TURNING_WORDS: Final = (
    english.NEGATIVES
    | english.CHOICES
    | english.REPETITIONS
    | english.COLOURS
    | english.EACH_DETERMINERS
    | english.TURNING_WORDS
)
"""Words that may turn the meaning round, also in a clause about a person or a place."""

_KEPT_WORDS: Final = _TURNING_WORDS | english.QUESTIONS | english.MODALS | english.UNIVERSAL
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
    found_tokens = tuple(_TOKEN.finditer(instruction))
    tokens = tuple(one.group() for one in found_tokens)
    if len(tokens) > _LONGEST_INSTRUCTION:
        return None
    candidates = _candidates(tokens, task_phrases(modules))
    found: dict[tuple[str, ...], NearestReading] = {}
    number_left_out = len(tokens)
    for tries, left_out in enumerate(candidates):
        if found and len(left_out) > number_left_out:
            break
        if tries == _MOST_TRIES:
            return None  # one that is not tried may be as near
        rest = frozenset(range(len(tokens))) - left_out
        text = _joined(_slices(instruction, found_tokens, rest)).lstrip(",;.!? ")
        try:
            meaning = understand(text, modules)
        except InstructionError:
            continue
        number_left_out = len(left_out)
        words = " … ".join(_slices(instruction, found_tokens, left_out))
        found.setdefault(meaning.formal_lines, NearestReading(meaning, words))
    return next(iter(found.values())) if len(found) == 1 else None


@dataclass(frozen=True, slots=True)
class _KeptWords:
    """The words of an instruction that are in no phrase which is left out.

    Attributes:
        turning: those that may turn the meaning round, also in a clause about a person or a place.
        stated: values of parameters, and the things of tasks.
        others: further ones.
    """

    turning: frozenset[str]
    stated: frozenset[str]
    others: frozenset[str]


def _kept_words(tokens: Sequence[str], tasks: Sequence[TaskPhrases]) -> _KeptWords:
    spoken = tuple(word for token in tokens for word in normalized_words(token))
    of_phrases = (
        word
        for at in range(len(spoken))
        for phrases in _KEPT_PHRASES
        for word in phrases.starting(spoken, at)
    )
    numbers = (word for word in spoken if _is_number(word))
    stated = (word for entry in tasks for value in entry.values for word in value.words)
    things = (word for entry in tasks for phrase in entry.objects for word in phrase)
    # `can you …` asks for no can.
    asked = {one for one, other in pairwise(spoken) if one in _ABILITY and other in _ADDRESSED}
    turning = _TURNING_WORDS.union(of_phrases, numbers) - english.DETERMINERS
    return _KeptWords(
        turning,
        frozenset({*stated, *things}) - english.DETERMINERS - asked,
        _KEPT_WORDS - turning - english.DETERMINERS - asked,
    )


def _is_number(word: str) -> bool:
    """Return True for `two`, `hundreds`, `2nd`, `x2` and `½`."""
    if word.removeprefix("x")[:1].isnumeric():
        return True
    return word not in _ARTICLES and any(
        english.number_of(one) is not None for one in english.base_forms(word)
    )


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
_CLAUSE_STARTS: Final = english.PERSONS | {"i", "we", "he", "she", "they"}
"""First words of a clause that says something, and asks for nothing; `where` is another one."""

_QUOTING: Final = frozenset(":\"'“‘«")
_KEPT_MARKS: Final = _QUOTING | frozenset("-−+#")
"""Marks that are in no phrase which is left out: those of quotations and of numbers."""

_BEFORE_ACTS: Final = frozenset({"if", "to", "you"})
_DUTIES: Final = frozenset({"must", "need", "needs", "ought", "should"})
_REPORTS: Final = frozenset({"already", "did", "done", "still", "ve"})
"""Words of a clause that reports something: `I'm still working on the right`."""


def _candidates(tokens: Sequence[str], tasks: Sequence[TaskPhrases]) -> list[frozenset[int]]:
    """Return the places of tokens that may be left out, the fewest first.

    They are the words that nothing declares, and one phrase or clause. They say something: without `off`
    alone, the rest would say another thing.
    """
    kept = _kept_words(tokens, tasks)
    all_kept = kept.turning | kept.stated | kept.others
    conditional = _conditional_places(tokens)
    is_kept = tuple(
        at in conditional or token in _KEPT_MARKS or not all_kept.isdisjoint(normalized_words(token))
        for at, token in enumerate(tokens)
    )
    undeclared = frozenset(unknown_words(" ".join(tokens), tasks))
    unknown = frozenset(
        at
        for at, token in enumerate(tokens)
        if not is_kept[at] and not undeclared.isdisjoint(normalized_words(token))
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
    found |= {
        unknown.union(clause)
        for clause in _clauses(tokens)
        if conditional.isdisjoint(clause) and _asks_for_nothing([tokens[at] for at in clause], kept)
    }
    acts = frozenset(phrase[0] for entry in tasks for phrase in entry.triggers)
    found = {one for one in found if not any(_governs(tokens, run, acts) for run in _runs(one))}
    return sorted(found, key=lambda places: (len(places), sorted(places)))


def _conditional_places(tokens: Sequence[str]) -> frozenset[int]:
    """Return the places of the words of conditions, each up to a pause."""
    words = [(at, word) for at, token in enumerate(tokens) for word in normalized_words(token)]
    spoken = tuple(word for _, word in words)
    found: set[int] = set()
    for place, (start, _) in enumerate(words):
        if any(one.starting(spoken, place) for one in (english.CONDITIONALS, english.TIME_CONDITIONALS)):
            found.update(range(start, _end_of_clause(tokens, start)))
    return frozenset(found)


def _end_of_clause(tokens: Sequence[str], start: int) -> int:
    """Return the place of the next pause."""
    return next((at for at in range(start, len(tokens)) if tokens[at] in _PAUSES), len(tokens))


def _clauses(tokens: Sequence[str]) -> Iterator[range]:
    """Yield each clause about a person or a place, up to a pause: `I have done the left`, `where it is`.

    That about a person is a clause of its own, behind a pause: `the guests leave` in `after the guests leave`
    is none.
    """
    for start, token in enumerate(tokens):
        first = normalized_words(token)[:1]
        if not first:
            continue
        begin = start
        while begin and english.DETERMINERS.issuperset(normalized_words(tokens[begin - 1]) or "?"):
            begin -= 1
        is_own = begin == 0 or tokens[begin - 1] in _PAUSES
        if (first[0] in _CLAUSE_STARTS and is_own) or first[0] == "where":
            begin = begin if first[0] in _CLAUSE_STARTS else start
            yield range(begin - (begin > 0 and tokens[begin - 1] in _PAUSES), _end_of_clause(tokens, start))


def _asks_for_nothing(clause: Sequence[str], kept: _KeptWords) -> bool:
    """Return True if a clause about a person or a place asks for nothing, and excludes nothing."""
    words = {word for token in clause for word in normalized_words(token)}
    if not words.isdisjoint(kept.turning | _DUTIES):
        return False
    return words.isdisjoint(kept.stated - _SMALL_WORDS) or not words.isdisjoint(_REPORTS)


def _governs(tokens: Sequence[str], run: range, acts: frozenset[str]) -> bool:
    """Return True if words stand right before an act, which they may turn round: `prevent cleaning …`.

    So may words before a colon or a quotation mark: `he said: …`.
    """
    if run.stop == len(tokens) or tokens[run.stop - 1] in _PAUSES:
        return False
    if tokens[run.stop] in _QUOTING:
        return True
    for word in normalized_words(tokens[run.stop])[:1]:
        is_form = english.is_gerund(word) and not acts.isdisjoint(english.base_forms(word))
        return word in acts or word in _BEFORE_ACTS or is_form
    return False


def _runs(places: frozenset[int]) -> Iterator[range]:
    """Yield the ranges of places that follow each other."""
    for start in sorted(at for at in places if at - 1 not in places):
        end = start
        while end in places:
            end += 1
        yield range(start, end)


def _slices(instruction: str, tokens: Sequence[re.Match[str]], places: frozenset[int]) -> Iterator[str]:
    """Yield the text of each range of tokens as it is written, so that `-1` does not become `- 1`."""
    for run in _runs(places):
        yield " ".join(instruction[tokens[run.start].start() : tokens[run.stop - 1].end()].split())


def _joined(slices: Iterator[str]) -> str:
    """Join texts with spaces, but for none before a pause."""
    return re.sub(r" (?=[,;:.!?])", "", " ".join(slices))
