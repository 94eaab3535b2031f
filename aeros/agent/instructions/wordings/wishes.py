"""Wishes: `may i have a tea`, `a tea would be nice`, `two teas please`."""

from __future__ import annotations

from collections.abc import Iterator

from aeros.agent.instructions import english
from aeros.agent.instructions.wordings.wording import WANT, Wording


def wishes(wording: Wording) -> Iterator[Wording]:
    """Read a wish as `i want …`.

    Args:
        wording: words of a request.

    Yields:
        The other forms.
    """
    words = wording.words
    if wish := english.WISHES.starting(words):
        yield wording.with_words(WANT + words[len(wish) :])
    # `how about two teas`, `i ll take two teas`, `give me a tea`
    marker = english.COUNTED_WISHES.starting(words)
    counted = words[len(marker) : len(marker) + 1]
    if marker and (counted in english.INDEFINITE or english.number_of("".join(counted)) is not None):
        yield wording.with_words(WANT + words[len(marker) :])
    if end := english.WISH_ENDS.ending(words):
        yield wording.with_words(WANT + words[: -len(end)])
        yield wording.with_words(words[: -len(end)])
