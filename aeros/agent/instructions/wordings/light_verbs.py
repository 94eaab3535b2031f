"""Light verbs: `give the table a wipe`, `do a quick wipe of the table`, `do the left half when cleaning`."""

from __future__ import annotations

from collections.abc import Iterator

from aeros.agent.instructions import english
from aeros.agent.instructions.wordings.wording import Wording


def intensified_nouns(wording: Wording) -> Iterator[Wording]:
    """Read `quick wipe of the table` as `wipe of the table`.

    Args:
        wording: words of a request.

    Yields:
        The other forms.
    """
    words = wording.words
    if words and words[0] in english.INTENSIFIERS:
        yield wording.with_words(words[1:])


def given_acts(wording: Wording) -> Iterator[Wording]:
    """Read `give the table a good wipe` as `the table a wipe`.

    Args:
        wording: words of a request.

    Yields:
        The other forms.
    """
    words = wording.words
    for at, word in enumerate(words):
        if word in ("give", "giving") and not english.PARTICLES.intersection(words[at + 1 : at + 2]):
            act = tuple(one for one in words[at + 1 :] if one not in english.INTENSIFIERS)
            yield wording.with_object_first(words[:at] + act)


def acts_named_last(wording: Wording) -> Iterator[Wording]:
    """Read `only the left half when cleaning` as `only the left half cleaning`.

    Args:
        wording: words of a request.

    Yields:
        The other forms.
    """
    words = wording.words
    if len(words) > 2 and english.is_gerund(words[-1]) and words[-2] in english.ACT_MARKERS:
        yield wording.with_object_first((*words[:-2], words[-1]))
