"""Splitting of text into words, in one case and one Unicode spelling."""

from __future__ import annotations

import unicodedata
from itertools import groupby


def normalized_words(text: str) -> tuple[str, ...]:
    """Split text into words, casefolded and in Unicode form NFKC.

    Marks belong to their letters: a vowel sign is as much part of a word as a vowel, and é is é however it is
    composed.

    Args:
        text: any text.

    Returns:
        The words: runs of letters with their marks, digits and `_`.
    """
    folded = unicodedata.normalize("NFKC", unicodedata.normalize("NFKC", text).casefold())
    return tuple("".join(run) for is_word, run in groupby(folded, _is_of_word) if is_word)


def _is_of_word(character: str) -> bool:
    return character.isalnum() or character == "_" or unicodedata.category(character).startswith("M")
