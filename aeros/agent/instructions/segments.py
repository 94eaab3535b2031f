"""Segments of sentences: requests, prohibitions, conditions and reasons, and how they are linked."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Final

from aeros.agent.instructions.phrases import Words

COMMA: Final = ","
"""Token of a comma among the words of a sentence."""

COLON: Final = ":"
"""Token of a colon among the words of a sentence."""


def without_commas(tokens: Words) -> Words:
    """Leave the commas out.

    Args:
        tokens: words and commas.

    Returns:
        The words.
    """
    return tuple(token for token in tokens if token != COMMA)


class Link(Enum):
    """Connection of a segment with the segment before it."""

    START = "start"  # the first segment of a sentence
    JOINED = "joined"  # `and`, or a comma: may share words with the segment before
    THEN = "then"  # comes after the segment before
    AFTER = "after"  # comes before the segment before
    ADJUNCT = "adjunct"  # a prohibition or a condition, said after a request without a comma


class Mood(Enum):
    """Sort of a segment."""

    REQUEST = "request"
    PROHIBITION = "prohibition"
    CONDITION = "condition"
    REASON = "reason"


@dataclass(frozen=True, slots=True)
class Segment:
    """Words that mean one thing.

    Attributes:
        mood: request, prohibition or condition.
        words: its words, without openers, closers and the words of prohibition or condition.
        link: connection with the segment before it.
        marker: words of the prohibition, condition or reason, as in `do not`; empty for a request.
        joint: word of the link, for messages; empty if there is none.
        is_new: True if its first words show that it is wanted, even after a prohibition.
        is_perfect: True if its verb is in the perfect, as in `once you have cleaned …`.
        openers: words before those of a request that change nothing in it, unless a task begins with them.
        closers: words after those of a request or condition that change nothing in it, unless a task ends
            with them.
        is_polite: True if its sentence has a word such as `please`.
        is_light: True if its verb is one that stands for others, such as `do`.
        carried: words of the first request of its sentence that it may go on with, as `have` in `have the
            table cleaned and a tea made`.
        is_otherwise: True if its sentence follows after `otherwise`.
        is_check: True if the condition of the next sentence is what it asks to check: it may be left out.
        is_of_set: True if it is of one of the things for all of which its sentence asks.
    """

    mood: Mood
    words: Words
    link: Link
    marker: Words = ()
    joint: str = ""
    is_new: bool = False
    is_perfect: bool = False
    openers: Words = ()
    closers: Words = ()
    is_polite: bool = False
    is_light: bool = False
    carried: tuple[Words, ...] = ()
    is_otherwise: bool = False
    is_check: bool = False
    is_of_set: bool = False

    @property
    def text(self) -> str:
        """Words for messages."""
        return " ".join(self.marker + self.words)


Sentence = tuple[Segment, ...]
