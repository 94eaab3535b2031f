"""Grammar of messages: the article before a name, and the noun after a number."""

from __future__ import annotations

import re
from typing import Final

_VOWEL_SOUND: Final = re.compile(r"[aeio]|u(?!ni|s[aeiou]|ti)|hour|honest", re.IGNORECASE)
"""Beginning of a word that is spoken as a vowel."""

_CONSONANT_Y: Final = re.compile(r"(?<=[^aeiou])y$")


def an(name: str) -> str:
    """Put the indefinite article before a name.

    Args:
        name: of an action, a variable or a kind.

    Returns:
        The name in backquotes, after `a` or `an`.
    """
    return f"{'an' if _VOWEL_SOUND.match(name) else 'a'} `{name}`"


def counted(number: int, noun: str) -> str:
    """Count things.

    Args:
        number: how many.
        noun: what they are, in the singular; its plural is regular.

    Returns:
        The number, and the noun in singular or plural.
    """
    return f"{number} {noun}" if number == 1 else f"{number} {_CONSONANT_Y.sub('ie', noun)}s"
