"""Relative clauses that change nothing: `the can that I asked for`, `the half that is on the left`."""

from __future__ import annotations

from typing import Final

from aeros.agent.instructions import english
from aeros.agent.instructions.phrases import Words

_CHOSEN: Final = frozenset({"whatever", "whichever"})
_RELATIVES: Final = frozenset({"that", "which"})


def without_relatives(tokens: Words) -> Words:
    """Leave out relative clauses that do not say which thing is meant; shorten those that say where it is.

    Args:
        tokens: words and commas of a sentence.

    Returns:
        `the half on the left` for `the half that is on the left`, and `the can` for `the can that I want`.
    """
    at = 1
    tokens = _with_plain_choice(tokens)
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


def _with_plain_choice(tokens: Words) -> Words:
    """Write `bring whichever is red` as `bring the red one`."""
    for at in range(1, len(tokens) - 2):
        has_noun = tokens[at + 1] == "one" or tokens[at + 1] in english.THING_NOUNS
        verb = at + 1 + has_noun
        is_colour = tokens[verb : verb + 1] == ("is",) and english.COLOURS.issuperset(
            tokens[verb + 1 : verb + 2]
        )
        if tokens[at] in _CHOSEN and is_colour and verb + 1 < len(tokens):
            return (*tokens[:at], "the", tokens[verb + 1], "one", *tokens[verb + 2 :])
    return tokens
