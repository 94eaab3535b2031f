"""Splitting of text into words, in one case and one Unicode spelling."""

from __future__ import annotations

import unicodedata
from itertools import groupby, product
from re import compile as pattern
from typing import Final

_OPTIONAL: Final = pattern(r"\(([^()]*)\)")

MAX_OPTIONAL: Final = 6
"""Limit on the optional parts of a phrase: each doubles the number of phrases."""


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


def expanded(text: str) -> tuple[str, ...]:
    """List the phrases that a phrase with optional parts stands for.

    Args:
        text: a phrase; words in brackets may be left out, as in `into (two) (marked) trays`.

    Returns:
        The phrases, the longest first; empty if its brackets do not match, a part of it is nested or empty,
        or it has more than `MAX_OPTIONAL` of them.
    """
    fixed, optional = _OPTIONAL.split(text)[::2], _OPTIONAL.findall(text)
    if len(optional) > MAX_OPTIONAL or not all(map(normalized_words, optional)):
        return ()
    if any(bracket in part for part in fixed for bracket in "()"):
        return ()
    found = []
    for chosen in product((True, False), repeat=len(optional)):
        kept = (one if is_kept else "" for one, is_kept in zip(optional, chosen, strict=True))
        parts = [part for pair in zip(fixed, (*kept, ""), strict=True) for part in pair]
        found.append(" ".join(" ".join(parts).split()))
    return tuple(found)


def _is_of_word(character: str) -> bool:
    return character.isalnum() or character == "_" or unicodedata.category(character).startswith("M")
