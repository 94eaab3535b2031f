"""Conditions of requests, in the words that a task declares for them."""

from __future__ import annotations

from typing import Final

from aeros.agent.instructions import english
from aeros.agent.instructions.lexicon import TaskPhrases
from aeros.agent.instructions.segments import Segment
from aeros.spec.diagnostics.words import normalized_words
from aeros.spec.expr import terms as t

_CONTRACTED: Final = {"isn": "is", "aren": "are", "wasn": "was", "hasn": "has"}
"""Verbs before a contracted `not`, as in `isn't`."""

_UNSTRESSED: Final = frozenset({"yet", "still", "currently"})


def find_condition(
    condition: Segment, entry: TaskPhrases, *, is_own: bool = False
) -> tuple[t.Term, str] | None:
    """Find the condition that a task declares for some words.

    Args:
        condition: segment with the words.
        entry: the task.
        is_own: True if the condition is of a request for the task, so that a pronoun, or no word, may stand
            for its object.

    Returns:
        The condition and its text as declared; None if the task does not declare it.
    """
    ignored = english.DETERMINERS | english.FILLERS | _UNSTRESSED
    spoken = tuple(word for word in condition.words if word not in ignored)
    if spoken[1:2] == ("s",):
        spoken = (spoken[0], "is", *spoken[2:])
    for at, verb in enumerate(spoken):
        if verb in _CONTRACTED and spoken[at + 1 : at + 2] == ("t",):
            spoken = (*spoken[:at], _CONTRACTED[verb], "not", *spoken[at + 2 :])
            break
    for phrase, declared in entry.routed.task.condition_phrases.items():
        words = tuple(word for word in normalized_words(phrase) if word not in english.DETERMINERS)
        subject = next((one for one in entry.objects if words[: len(one)] == one), ())
        rest = words[len(subject) :]
        shorter = {("it", *rest), ("they", *rest), rest[1:]} if subject and is_own else set()
        if spoken == words or (spoken and spoken in shorter):
            return declared.term, declared.text
    return None
