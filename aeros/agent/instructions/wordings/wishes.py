"""Wishes: `may i have a tea`, `a tea would be nice`, `two teas please`."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from aeros.agent.instructions import english
from aeros.agent.instructions.wordings.wording import WANT, Wording

_ABOUT: Final = (("how", "about"), ("what", "about"))


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
    if words[:2] in _ABOUT and (
        words[2:3] in english.INDEFINITE or english.number_of("".join(words[2:3])) is not None
    ):
        yield wording.with_words(WANT + words[2:])  # `how about two teas`
    if end := english.WISH_ENDS.ending(words):
        yield wording.with_words(WANT + words[: -len(end)])
        yield wording.with_words(words[: -len(end)])
