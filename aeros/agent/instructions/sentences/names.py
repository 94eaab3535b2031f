"""Names of people, which no list can hold: `a tea for Mia`, `Leo's cup`, `hey Robbie`.

A capital letter within a sentence, and a place where a person may be named, show one.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Final

from aeros.spec.diagnostics.words import normalized_words

_FOR: Final = re.compile(
    r"(?<=\bfor )([A-Z][a-z]+)((?: and [A-Z][a-z]+)?)"
    r"(?=[,.;!?]|$| (?:please|now|too|and (?:one|a|another))\b)"
)
_GREETED: Final = re.compile(
    r"(?<![^\s.!?,])((?:[Hh]ey|[Hh]i|[Hh]ello|[Oo]kay|[Oo]k|OK|[Dd]ear) )([A-Z][a-z]+)(?=[,!.])"
)
_CALLED: Final = re.compile(r", ([A-Z][a-z]+)(?=\?)")
_TITLED: Final = re.compile(
    r"\b(?:[Mm]r|[Mm]rs|[Mm]s|[Mm]iss|[Dd]r|[Pp]rof|[Pp]rofessor|[Dd]octor|[Ss]ister)\.? ([A-Z][a-z]+)"
)
_OWNER: Final = re.compile(r"(?<=[a-z] )([A-Z][a-z]+)['\u2019]s(?= [a-z])")
_SIGNED: Final = re.compile(
    r"(?<=[.!?,\n] )((?:[Kk]ind|[Bb]est|[Ww]arm|[Mm]any|[Ww]ith (?:kind|best|many)|[Yy]ours|)\s?"
    r"(?:[Rr]egards|[Ww]ishes|[Tt]hanks|[Tt]hank you|[Cc]heers|sincerely|truly|[Bb]est)),?"
    r"\s+([A-Z][a-z]+)[.!]?\s*$"
)
NO_NAMES: Final = frozenset(
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
        return len(spoken) == 1 and spoken[0] not in NO_NAMES and not is_known(spoken[0])

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

    text = _TITLED.sub(lambda match: replaced(match, match[1], match[1]), instruction)
    text = _FOR.sub(for_each, text)
    text = _GREETED.sub(lambda match: replaced(match, match[2], f"{match[1]}robot"), text)
    text = _SIGNED.sub(lambda match: replaced(match, match[2], match[1]), text)
    text = _CALLED.sub(lambda match: replaced(match, match[1], ""), text)
    text = _OWNER.sub(lambda match: replaced(match, match[1], "my"), text)
    return text, tuple(f"read `{name}` as the name of a person" for name in account)
