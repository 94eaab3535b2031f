"""Names of people, which no list can hold: `a tea for Mia`, `Leo's cup`, `hey Robbie`.

A capital letter within a sentence, and a place where a person may be named, show one.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import Final

from aeros.agent.instructions import english
from aeros.agent.instructions.lexicon import TaskPhrases, words_in
from aeros.spec.diagnostics.words import normalized_words

_FOR: Final = re.compile(
    r"(?<=\bfor )([A-Z][a-z]+)((?: and [A-Z][a-z]+)?)(?=[,.;!?]|$| (?:please|now|too)\b)"
)
_GREETED: Final = re.compile(
    r"(?<![^\s.!?,])((?:[Hh]ey|[Hh]i|[Hh]ello|[Oo]kay|[Oo]k|OK|[Dd]ear) )([A-Z][a-z]+)(?=[,!.])"
)
_CALLED: Final = re.compile(r", ([A-Z][a-z]+)(?=\?)")
_OWNER: Final = re.compile(r"(?<=[a-z] )([A-Z][a-z]+)['\u2019]s(?= [a-z])")
_NO_NAMES: Final = frozenset(
    {
        *(
            "monday",
            "tuesday",
            "wednesday",
            "thursday",
            "friday",
            "saturday",
            "sunday",
            "christmas",
            "easter",
        ),
        *("january", "february", "march", "april", "may", "june", "july", "august", "september", "october"),
        *(
            "abort",
            "disregard",
            "halt",
            "kidding",
            "joking",
            "nah",
            "negative",
            "nope",
            "undo",
            "wait",
            "whoa",
        ),
        *("november", "december", "today", "tomorrow", "tonight", "later", "lunch", "dinner", "breakfast"),
    }
)
"""Words with a capital letter that name a time, or may take back what is asked for."""


_ADDRESS: Final = re.compile(r"\s*([^\W\d_]+(?:[ '\u2019-][^\W\d_]+){0,2})\s*[,!]+\s+(?=\S)")
"""Up to three words before the first pause of an instruction."""


def form_of_address(instruction: str, tasks: Sequence[TaskPhrases]) -> tuple[str, str]:
    """Part a form of address or an exclamation, which no list can hold, from the rest: `Bhaiya, …`.

    Args:
        instruction: words of the user.
        tasks: all tasks.

    Returns:
        The address and the rest; two empty texts if the first words may be about the request: they have a
        word of a task, of time or place, a negation or the like, or the rest goes on with `and`.
    """
    found = _ADDRESS.match(instruction)
    if found is None:
        return "", ""
    words, rest = normalized_words(found[1]), instruction[found.end() :]
    of_tasks = {
        word
        for entry in tasks
        for phrases in (entry.triggers, entry.objects, tuple(one.words for one in entry.values))
        for word in words_in(phrases)
    }
    doubtful = english.BARRED | english.DETERMINERS | english.PLACES | english.POSITIONS | english.DIRECTIONS
    doubtful |= (
        english.POSSESSIVES
        | english.QUESTIONS
        | english.NO_ADDRESS
        | english.DOUBTFUL_ADVERBS
        | _NO_NAMES
        | english.SUBJECTS
        | {"please"}
    )
    is_link = english.SEQUENCE.starting(normalized_words(rest)) or english.CONDITIONALS.starting(words)
    if is_link or not (doubtful | of_tasks).isdisjoint(words):
        return "", ""
    return found[1], rest


def without_names(instruction: str, is_known: Callable[[str], bool]) -> tuple[str, tuple[str, ...]]:
    """Replace the names of people by words that the grammar has.

    Args:
        instruction: words of the user.
        is_known: says if a task or the grammar has a word.

    Returns:
        The instruction, and a line for each name.
    """
    account: dict[str, None] = {}

    def is_name(word: str) -> bool:
        spoken = normalized_words(word)
        return len(spoken) == 1 and spoken[0] not in _NO_NAMES and not is_known(spoken[0])

    def replaced(match: re.Match[str], name: str, other: str) -> str:
        if not is_name(name):
            return match.group()
        account[name] = None
        return other

    def for_each(match: re.Match[str]) -> str:
        names = match.group().split(" and ")
        if not all(map(is_name, names)):
            return match.group()
        account.update(dict.fromkeys(names))
        return "them" if len(names) > 1 else "her"

    text = _FOR.sub(for_each, instruction)
    text = _GREETED.sub(lambda match: replaced(match, match[2], f"{match[1]}robot"), text)
    text = _CALLED.sub(lambda match: replaced(match, match[1], ""), text)
    text = _OWNER.sub(lambda match: replaced(match, match[1], "my"), text)
    return text, tuple(f"read `{name}` as the name of a person" for name in account)
