"""Wishes: `may i have a tea`, `a tea would be nice`, `two teas please`."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from aeros.agent.instructions import english
from aeros.agent.instructions.wordings.wording import WANT, Wording

_OF_CLAUSES: Final = (("if",), ("that",), ("could",))


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
        wanted = words[: -len(end)]
        causative = english.CAUSATIVES.starting(wanted)
        if causative[-1:] in _OF_CLAUSES:
            wanted = wanted[len(causative) :]  # `it would be nice if a wipe of the table could be done`
        yield wording.with_object_first(WANT + wanted)
        # `a wipe of the table would be nice`; `wipe the table is on the menu` asks for nothing
        is_named = wanted[:1] and (wanted[0] in english.DETERMINERS or english.is_act_noun(wanted[0]))
        yield wording.with_words(wanted) if is_named else wording.with_object_first(wanted)
