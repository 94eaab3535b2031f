"""Text as words: in one case, in one spelling of each character, and whole."""

from __future__ import annotations

import unicodedata
from itertools import groupby


def normalized_words(text: str) -> tuple[str, ...]:
    """The words of `text`: runs of letters with their marks, digits and `_`, whatever case they are in.

    Marks belong to their letters: a vowel sign is as much of a word as a vowel, and é is é however it is
    composed.
    """
    folded = unicodedata.normalize("NFKC", unicodedata.normalize("NFKC", text).casefold())
    return tuple("".join(run) for is_word, run in groupby(folded, _is_of_word) if is_word)


def _is_of_word(character: str) -> bool:
    return character.isalnum() or character == "_" or unicodedata.category(character).startswith("M")
