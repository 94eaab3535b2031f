"""One form in which the words of a request may be read."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final

from aeros.agent.instructions.phrases import PhraseSet, Words

WANT: Final[Words] = ("i", "want")
"""The wish that a module may declare, into which all other wishes are turned."""


@dataclass(frozen=True, slots=True)
class Wording:
    """Words of a request in one of the forms that it may be read in.

    Attributes:
        words: the words to cover.
        is_perfect: True if its verb may be a past participle.
        needs_object_first: True if the object has to come before the verb, as in `the table cleaned`.
    """

    words: Words
    is_perfect: bool = False
    needs_object_first: bool = False

    def with_words(self, words: Words) -> Wording:
        """Return the same form of other words.

        Args:
            words: the words.

        Returns:
            The wording.
        """
        return replace(self, words=words)

    def with_object_first(self, words: Words, *, is_perfect: bool = False) -> Wording:
        """Return a form in which the object has to come before the verb.

        Args:
            words: the words.
            is_perfect: True if the verb may be a past participle.

        Returns:
            The wording.
        """
        return Wording(words, self.is_perfect or is_perfect, needs_object_first=True)


def without_each(words: Words, phrases: PhraseSet) -> Iterator[Words]:
    """Leave out a phrase that stands among some words.

    Args:
        words: the words.
        phrases: the phrases.

    Yields:
        The words without the phrase, for each place but the first.
    """
    for at in range(1, len(words)):
        if found := phrases.starting(words, at):
            yield words[:at] + words[at + len(found) :]
