"""Relative clauses that change nothing: `the can that I asked for`, `the half that is on the left`."""

from __future__ import annotations

from typing import Final

from aeros.agent.instructions import english
from aeros.agent.instructions.phrases import Words

_RELATIVES: Final = frozenset({"that", "which"})


def without_relatives(tokens: Words) -> Words:
    """Leave out relative clauses that do not say which thing is meant; shorten those that say where it is.

    Args:
        tokens: words and commas of a sentence.

    Returns:
        `the half on the left` for `the half that is on the left`, and `the can` for `the can that I want`.
    """
    at = 1
    while at < len(tokens):
        clause = english.RELATIVES.starting(tokens, at)
        is_of_noun = tokens[at - 1] not in english.DETERMINERS | english.PRONOUNS | {"one"}
        if clause and at > 1 and tokens[at - 2] in english.DETERMINERS | english.COLOURS and is_of_noun:
            tokens = tokens[:at] + tokens[at + len(clause) :]
        elif (
            tokens[at] in _RELATIVES
            and tokens[at - 1] in english.PLACE_NOUNS
            and tokens[at + 1 : at + 2]
            and tokens[at + 1] in english.BE
            and tokens[at + 2 : at + 3]
            and tokens[at + 2] in english.POSITIONS
        ):
            tokens = tokens[:at] + tokens[at + 2 :]
        at += 1
    return tokens
