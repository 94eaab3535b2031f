"""Splitting of text into words, in one case and one Unicode spelling."""

from __future__ import annotations

import unicodedata
from functools import lru_cache
from itertools import groupby, product
from math import prod
from re import compile as pattern
from typing import Final

_GROUP: Final = pattern(r"\(([^()]*)\)")
_ASCII_WORD: Final = pattern(r"[a-z0-9_]+")

MAX_PHRASES: Final = 512
"""Limit on the phrases that one pattern stands for."""


@lru_cache(maxsize=1 << 13)
def normalized_words(text: str) -> tuple[str, ...]:
    """Split text into words, casefolded and in Unicode form NFKC.

    Marks belong to their letters: a vowel sign is as much part of a word as a vowel, and é is é however it is
    composed.

    Args:
        text: any text.

    Returns:
        The words: runs of letters with their marks, digits and `_`.
    """
    if text.isascii():  # all but a few phrases; one in any case is the same in both forms
        return tuple(_ASCII_WORD.findall(text.lower()))
    folded = unicodedata.normalize("NFKC", unicodedata.normalize("NFKC", text).casefold())
    return tuple("".join(run) for is_word, run in groupby(folded, _is_of_word) if is_word)


@lru_cache(maxsize=1 << 10)
def expanded(text: str) -> tuple[str, ...]:
    """List the phrases that a pattern stands for.

    Args:
        text: a phrase; words in brackets may be left out, as in `into (two) trays`; of words parted by bars
            in brackets, one is said, as in `into the (tray|box)`, or none, as in `wipe (up|down|)`.

    Returns:
        The phrases, first those with the words in brackets; empty if the brackets do not match, one is nested
        or has an empty part, or there are more than `MAX_PHRASES` phrases.
    """
    parts = _GROUP.split(text)
    if any(bracket in part for part in parts[::2] for bracket in "(|)"):
        return ()
    choices: list[tuple[str, ...]] = []
    for group in parts[1::2]:
        *alternatives, last = group.split("|")
        # A last alternative may be empty: `(up|down|)`.
        if not all(map(normalized_words, alternatives)) or not (alternatives or normalized_words(last)):
            return ()
        choices.append((*alternatives, last) if alternatives else (last, ""))
    if prod(map(len, choices)) > MAX_PHRASES:
        return ()
    found = []
    for chosen in product(*choices):
        words = (part for pair in zip(parts[::2], (*chosen, ""), strict=True) for part in pair)
        found.append(" ".join(" ".join(words).split()))
    return tuple(found)


def _is_of_word(character: str) -> bool:
    return character.isalnum() or character == "_" or unicodedata.category(character).startswith("M")
