"""Other orders of words: `tidy the table up`, `the can of red colour`, `the block that is blue`."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from aeros.agent.instructions import english
from aeros.agent.instructions.wordings.wording import Wording

_COLOUR: Final = ("color", "colour")
_SIDES: Final = frozenset({"left", "right"})


def particles(wording: Wording) -> Iterator[Wording]:
    """Put a particle, or for whom it is, beside the verb: `pick me up a book` is `pick up me a book`.

    Args:
        wording: words of a request.

    Yields:
        The other forms.
    """
    words = wording.words
    for at in range(2, len(words)):
        # `put it right over` says how, and no side; `put it on the right over` may.
        says_how = words[at - 1] in _SIDES and words[at - 2] not in english.DETERMINERS | english.POSITIONS
        if (
            (words[at] in english.PARTICLES or words[at] == "ready")
            and words[at - 2 : at] != ("right", "side")
            and not says_how
        ):
            yield wording.with_words((words[0], words[at], *words[1:at], *words[at + 1 :]))
        elif words[at] == "for" and at + 1 < len(words):
            yield wording.with_words((words[0], *words[at:], *words[1:at]))  # `lay for six the table`


def attributes(wording: Wording) -> Iterator[Wording]:
    """Put a colour before its noun: `the can of red colour`, `the can that is red` are `the red cup`.

    Args:
        wording: words of a request.

    Yields:
        The other forms.
    """
    words = wording.words
    for at in range(1, len(words)):
        attribute, end = "", at
        if words[at] == "of" and words[at + 2 : at + 3] and words[at + 2] in _COLOUR:
            attribute, end = words[at + 1], at + 3
        elif words[at] in ("that", "which") and words[at + 1 : at + 2] in (("is",), ("s",)):
            attribute, end = "".join(words[at + 2 : at + 3]), at + 3
        elif words[at] in (*_COLOUR, "coloured", "colored") and words[at - 1] in english.COLOURS:
            yield wording.with_words((*words[:at], *words[at + 1 :]))  # `the blue colour cup`
        if attribute and end <= len(words):
            yield wording.with_words((*words[: at - 1], attribute, words[at - 1], *words[end:]))
