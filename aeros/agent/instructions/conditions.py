"""Conditions of requests, in the words that a task declares for them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Final

from aeros.agent.instructions import english
from aeros.agent.instructions.lexicon import TaskPhrases
from aeros.agent.instructions.phrases import Words
from aeros.agent.instructions.segments import Mood, Segment
from aeros.spec.diagnostics.words import normalized_words
from aeros.spec.expr import terms as t

_CONTRACTED: Final = {"isn": "is", "aren": "are", "wasn": "was", "hasn": "has"}
"""Verbs before a contracted `not`, as in `isn't`."""

_UNSTRESSED: Final = frozenset({"yet", "still", "currently", "again", "all", "any", "actually", "indeed"})
_IS: Final = ("is",)


@dataclass(frozen=True, slots=True)
class FoundCondition:
    """Condition that some words mean.

    Attributes:
        term: the condition.
        text: its text, from the module's.
        is_negated: True if the words negate the condition that the module declares.
    """

    term: t.Term
    text: str
    is_negated: bool = False

    @property
    def negated(self) -> FoundCondition:
        """The condition that holds iff this one does not."""
        if self.is_negated and isinstance(self.term, t.Not):
            return FoundCondition(self.term.operand, self.text.removeprefix("not (").removesuffix(")"))
        return FoundCondition(t.Not(self.term), f"not ({self.text})", is_negated=True)


def find_condition(condition: Segment, entry: TaskPhrases, *, is_own: bool = False) -> FoundCondition | None:
    """Find the condition that a task declares for some words.

    Args:
        condition: segment with the words.
        entry: the task.
        is_own: True if the condition is of a request for the task, so that a pronoun, or no word, may stand
            for its object.

    Returns:
        The condition; None if the task does not declare it.
    """
    spoken = _plain(condition.words)
    found = _declared(spoken, entry, is_own=is_own)
    if found is None and condition.mood is Mood.CONDITION and len(spoken) > 1 and not {*_IS} & {*spoken}:
        found = _declared((*spoken[:-1], *_IS, spoken[-1]), entry, is_own=is_own)  # `if table dirty`
    if found is None and english.FINDINGS.ending(condition.marker):
        # `if you find the table dirty`, `if you see crumbs on it`
        forms = ((*spoken[:-1], *_IS, *spoken[-1:]), ("there", *_IS, *spoken))
        return next((one for form in forms if (one := _declared(form, entry, is_own=is_own))), None)
    if found is None and "not" in spoken and spoken[max(0, spoken.index("not") - 1)] == "is":
        at = spoken.index("not")
        positive = _declared((*spoken[:at], *spoken[at + 1 :]), entry, is_own=is_own)
        return None if positive is None else positive.negated
    return found


def _declared(spoken: Words, entry: TaskPhrases, *, is_own: bool) -> FoundCondition | None:
    for phrase, declared in entry.routed.task.condition_phrases.items():
        words = _plain_phrase(phrase)
        subject = next((one for one in entry.objects if words[: len(one)] == one), ())
        rest = words[len(subject) :]
        shorter = {("it", *rest), ("they", *rest), rest[1:]} if subject and is_own else set()
        shorter |= {(*one, *rest) for one in entry.objects} if subject else set()
        names_object = bool(subject) or any(words[-len(one) :] == one for one in entry.objects)
        if not names_object and not is_own and entry.objects:
            continue  # `if needed` is of the request that it stands with
        if words and not subject and words[0] not in ("it", "there"):
            shorter.add(("it", *_IS, *words))  # `if it is needed`
        place = next((words[: -len(one) - 1] for one in entry.objects if words[-len(one) :] == one), ())
        if place and words[:1] == ("there",) and is_own:
            # `if there is dust on it`
            shorter |= {place, (*place, *words[len(place) : len(place) + 1], "it")}
        if spoken == words or (spoken and spoken in shorter):
            return FoundCondition(declared.term, declared.text)
    return None


@lru_cache(maxsize=1 << 12)
def _plain_phrase(phrase: str) -> Words:
    return _plain(normalized_words(phrase))


def _plain(words: Words) -> Words:
    """Leave out what changes nothing, and write every form of `be` as `is`: `looks`, `has been`."""
    for at, verb in enumerate(words):
        if verb in _CONTRACTED and words[at + 1 : at + 2] == ("t",):
            words = (*words[:at], _CONTRACTED[verb], "not", *words[at + 2 :])
            break
    if ("no", "longer") in pairwise(words):
        at = words.index("longer") - 1
        words = (*words[:at], "not", *words[at + 2 :])
    plain: list[str] = []
    at = 0
    ignored = (english.DETERMINERS | english.FILLERS | _UNSTRESSED) - english.DEGREES
    while at < len(words):
        being = english.BEING.starting(words, at) if plain or at else ()
        if being:
            plain += [*_IS, "not"] if "not" in being else _IS
        elif words[at] not in ignored or (plain[-1:] == ["is"] and at + 1 == len(words)):
            plain.append(words[at])  # `the table is filthy`
        at += len(being) or 1
    if plain[1:2] == ["s"]:
        plain[1] = "is"
    return tuple(plain)
