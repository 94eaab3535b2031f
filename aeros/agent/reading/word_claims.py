"""Account of a model for the words of an instruction, and the check of that account.

A model claims for each phrase the part of its answer that it accounts for. A claim about words that are not
there is a problem. So is a part that no word accounts for, and a word that can turn a meaning round, such as
a negation, a number or a choice, in a claim that does not carry it. Words without a claim are unaccounted.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from aeros.agent.instructions import english
from aeros.agent.instructions.phrases import PhraseSet, Words
from aeros.spec.diagnostics.codes import quoted
from aeros.spec.diagnostics.words import normalized_words

COURTESY: Final = "courtesy"
"""Part of words that ask for nothing, such as `please`."""

ORDER: Final = "order"
"""Part of words that only order the requests, such as `then`."""

_IDIOMS: Final = (english.OPENERS, english.CLOSERS, english.SENTENCE_OPENERS, english.SEQUENCE)
"""Phrases that ask for nothing, also where a word of them is a negation, as in `don't forget to`."""

_TURNED: Final = (english.REVERSED, english.LEADING)
_CONDITIONALS: Final = frozenset({"if", "unless", "till", "until", "when", "whenever", "while"})


@dataclass(frozen=True, slots=True)
class WordClaim:
    """Claim that a phrase of the instruction accounts for a part of the answer.

    Attributes:
        phrase: words of the instruction.
        part: `request N`, `condition N`, `prohibition N`, `order` or `courtesy`; N counts from 1.
    """

    phrase: str
    part: str

    @property
    def words(self) -> Words:
        """The normalized words of the phrase."""
        return normalized_words(self.phrase)


@dataclass(frozen=True, slots=True)
class WordAccount:
    """Checked account for the words of an instruction.

    Attributes:
        unaccounted: words without a claim, in order.
        problems: reasons to reject the account.
    """

    unaccounted: Words
    problems: tuple[str, ...]


def check_claims(
    instruction: str, claims: Sequence[WordClaim], goals: Mapping[str, str], nouns: Collection[Words]
) -> WordAccount:
    """Check a model's account for the words of an instruction.

    Args:
        instruction: words of the user.
        claims: the account.
        goals: formal text of each part of the answer that a word must account for, by `WordClaim.part`.
        nouns: phrases that name objects of tasks; none of them is courtesy.

    Returns:
        The words that are not accounted for, and the problems.
    """
    spoken = normalized_words(instruction)
    parts: list[str | None] = [None] * len(spoken)
    problems: list[str] = []
    for claim in claims:
        if claim.part not in (*goals, ORDER, COURTESY):
            problems.append(
                f"{quoted(claim.phrase)} accounts for {quoted(claim.part)}, which the answer lacks"
            )
        at = _free_place(claim.words, spoken, parts)
        if at is None:
            problems.append(f"the instruction has no {quoted(claim.phrase)} that is not yet accounted for")
            continue
        parts[at : at + len(claim.words)] = [claim.part] * len(claim.words)
        problems += _misplaced_words(claim, goals.get(claim.part, ""), nouns)
    problems += [f"no word accounts for {part}" for part in goals if part not in parts]
    problems += _order_problems(parts, is_turned=_is_turned(claims))
    unaccounted = tuple(word for word, part in zip(spoken, parts, strict=True) if part is None)
    return WordAccount(unaccounted, tuple(problems))


def _free_place(words: Words, spoken: Words, parts: Sequence[str | None]) -> int | None:
    """Find the first place of some words where none of them has a claim yet."""
    for at in range(len(spoken) - len(words) + 1 if words else 0):
        end = at + len(words)
        if spoken[at:end] == words and all(part is None for part in parts[at:end]):
            return at
    return None


def _misplaced_words(claim: WordClaim, formal: str, nouns: Collection[Words]) -> Iterator[str]:
    """Yield a problem for each word that the part of its claim cannot carry."""
    kind = claim.part.partition(" ")[0]
    if kind in ("prohibition", "condition"):
        return
    rest = claim.words
    if kind != "request":
        rest = _without(rest, (*_IDIOMS, *_TURNED) if kind == ORDER else _IDIOMS)
        for noun in nouns:
            if any(rest[at : at + len(noun)] == noun for at in range(len(rest))):
                yield f"{quoted(' '.join(noun))} in {quoted(claim.phrase)} names an object; it is no {kind}"
    numerals = {int(one[:18]) for one in re.findall(r"\d+", formal)}
    turning = english.NEGATIVES | english.CHOICES | english.REPETITIONS | _CONDITIONALS
    for word in rest:
        number = english.number_of(word)
        if word in turning or (number not in (None, 1) and number not in numerals):
            yield f"{quoted(word)} in {quoted(claim.phrase)} is not carried by {quoted(claim.part)}"


def _without(words: Words, idioms: Sequence[PhraseSet]) -> Words:
    """Remove known phrases, the longest first, from the left."""
    rest: list[str] = []
    at = 0
    while at < len(words):
        found = max((one.starting(words, at) for one in idioms), key=len)
        rest += () if found else (words[at],)
        at += len(found) or 1
    return tuple(rest)


def _order_problems(parts: Sequence[str | None], *, is_turned: bool) -> Iterator[str]:
    """Yield a problem if requests are done in another order than that of their words without a reason.

    `is_turned` is True if a word such as `after` is claimed to turn the order.
    """
    if is_turned:
        return
    first = {part: parts.index(part) for part in parts if part is not None and part.startswith("request ")}
    numbers = sorted(first, key=lambda part: first[part])
    if numbers != sorted(numbers, key=lambda part: int(part.partition(" ")[2])):
        yield f"the instruction has the order {', '.join(numbers)}, and no word accounts for another order"


def _is_turned(claims: Sequence[WordClaim]) -> bool:
    return any(claim.part == ORDER and any(claim.words in one for one in _TURNED) for claim in claims)
