"""Reasons within a sentence: `because …`, `so that …`, `the table is dirty, so …`."""

from __future__ import annotations

from typing import Final

from aeros.agent.instructions import english
from aeros.agent.instructions.phrases import Words
from aeros.agent.instructions.reasons.statements import is_statement
from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.segments import COMMA, Link, Mood, Segment, without_commas
from aeros.spec.diagnostics.codes import quoted

_VERBS: Final = english.FINITE | english.FINITE_OF_PERSONS | english.MODALS | english.DESIRES


def without_reasons(tokens: Words) -> tuple[Words, list[Segment]]:
    """Take the reasons out of a sentence: `because …`, `so that …`, and `the …, so` before a request.

    Args:
        tokens: words and commas of a sentence.

    Returns:
        The rest, and the reasons.

    Raises:
        InstructionError: it is not clear where a reason ends.
    """
    reasons: list[Segment] = []
    at = 0
    while at < len(tokens):
        if english.DURATIONS.starting(tokens, at):
            at += len(english.DURATIONS.starting(tokens, at))  # `as long as` begins a condition
            continue
        marker = english.REASONS.starting(tokens, at)
        after = at + len(marker)
        if marker == ("so",) and at and not reasons and _is_reason(tokens, at):
            # `the table is dirty, so please clean it`
            reasons.append(Segment(Mood.REASON, without_commas(tokens[:at]), Link.START, marker))
            tokens, at = tokens[after:], 0
        elif marker and _begins_reason(tokens, at, marker):
            end = next((to for to in range(after, len(tokens)) if _ends_reason(tokens, to)), len(tokens))
            if end == after or (at == 0 and tokens[end : end + 1] != (COMMA,)):
                return tokens, reasons
            if at and tokens[end : end + 1] == (COMMA,) and not english.SEQUENCE.starting(tokens, end + 1):
                rest = quoted(" ".join(tokens[end + 1 :]))
                raise InstructionError(
                    f"is {rest} a part of the reason, or wanted, too? say it in two sentences"
                )
            link = Link.ADJUNCT if at else Link.START
            reasons.append(Segment(Mood.REASON, tokens[after:end], link, marker))
            tokens = tokens[:at] + tokens[end + (at == 0) :]
        else:
            at += 1
    return tokens, reasons


def _is_reason(tokens: Words, at: int) -> bool:
    """Return True if what stands before `so` states something."""
    is_of_opener = len(english.OPENERS.starting(tokens)) > at  # `i should be so grateful if you …`
    if is_of_opener or tokens[at + 1 : at + 2] in (("much",), ("many",), ("very",)):
        return False
    stated = without_commas(tokens[:at])
    return is_statement(stated) or (tokens[at - 1] == COMMA and tokens[0] in english.SUBJECTS)


def _begins_reason(tokens: Words, at: int, marker: Words) -> bool:
    after = tokens[at + len(marker) : at + len(marker) + 1]
    others = (english.SEQUENCE, english.SENTENCE_OPENERS, english.CONDITIONALS)
    longer = max(len(one.starting(tokens, at)) for one in others)
    if not after or tokens[at - 1 : at] == ("well",) or after == (COMMA,) or longer > len(marker):
        return False
    end = tokens.index(COMMA, at) if COMMA in tokens[at:] else len(tokens)
    if not any(word in _VERBS or word.endswith("ed") for word in tokens[at + len(marker) : end]):
        return marker[0] in ("because", "due", "in")
    return marker[0] in ("because", "due", "in") or marker[-1] == "that" or after[0] in english.SUBJECTS


def _ends_reason(tokens: Words, at: int) -> bool:
    link = english.SEQUENCE.starting(tokens, at)
    return (
        tokens[at] == COMMA or (bool(link) and link != ("and",)) or bool(english.REASONS.starting(tokens, at))
    )
