"""Sentences with two branches: `if the table is dirty, clean it, otherwise bring me the can`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Final, NamedTuple

from aeros.agent.instructions import english
from aeros.agent.instructions.phrases import Words
from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.segments import COMMA
from aeros.agent.instructions.sentences.checks import SpokenSentence, after_denial
from aeros.spec.diagnostics.codes import quoted

_ELSE: Final = "else"


class Branch(NamedTuple):
    """Sentence, or one of the two branches of a sentence.

    Attributes:
        tokens: its words and commas, without `otherwise`.
        is_question: True if it ends with a question mark.
        is_otherwise: True if it is done if the condition of the request before does not hold.
    """

    tokens: Words
    is_question: bool
    is_otherwise: bool


def with_branches(sentences: Iterable[SpokenSentence]) -> Iterator[Branch]:
    """Split each sentence before `otherwise`, `else` or `if not`.

    Args:
        sentences: the sentences.

    Yields:
        The sentences. A sentence without a condition is split only if it begins with `otherwise`.

    Raises:
        InstructionError: a sentence has more than two branches.
    """
    for tokens, is_question in sentences:
        at, after = _find(tokens)
        if after == 0:
            yield Branch(tokens, is_question, False)
            continue
        rest = tokens[after:]
        if any(_end_of_marker(rest, place) for place in range(len(rest))):
            whole = quoted(" ".join(tokens).replace(" ,", ","))
            raise InstructionError(
                f"{whole} has a second `otherwise`, which is not understood: say the second condition in an "
                "instruction of its own"
            )
        if at:
            first = tokens[: at - 1] if tokens[at - 1] == COMMA else tokens[:at]
            yield Branch(first, is_question, False)
        yield Branch(rest, is_question and at == 0, True)


def _find(tokens: Words) -> tuple[int, int]:
    """Return the place of the words for `otherwise`, and the first place after them; 0, 0 for none."""
    has_condition = False
    for at in range(len(tokens)):
        end = _end_of_marker(tokens, at)
        if end < len(tokens) and end and (at == 0 or has_condition):
            return at, end
        has_condition = has_condition or bool(english.CONDITIONALS.starting(tokens, at))
    return 0, 0


def _end_of_marker(tokens: Words, at: int) -> int:
    """Return the first token after words for `otherwise` and their comma; 0 if none begin at `at`."""
    marker = english.OTHERWISE.starting(tokens, at)
    before = tokens[at - 1] if at else COMMA
    if marker == (_ELSE,) and before in english.ELSE_PRONOUNS:
        return 0
    if not marker:
        return after_denial(tokens, at)
    if english.REASONS.ending(tokens[:at]):
        return 0  # `…, because otherwise guests complain`
    end = at + len(marker)
    return end + 1 if tokens[end : end + 1] == (COMMA,) else end
