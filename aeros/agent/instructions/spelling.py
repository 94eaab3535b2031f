"""Typing slips: a word that is nearly one word of a task is read as that, and the reading shown.

Only long words of acts, things and additions are corrected. A word for a value, a condition or a place in the
grammar is not: a slip in it may change the meaning.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Final

from aeros.agent.instructions import english
from aeros.agent.instructions.lexicon import TaskPhrases
from aeros.spec.diagnostics.words import normalized_words

_WORD: Final = re.compile(r"[^\W\d_]+")
_MIN_LENGTH: Final = 6
_MIN_TURNED: Final = 5
"""Shortest word of which two neighbouring letters may be turned round, as in `tabel`."""


def without_slips(instruction: str, tasks: Sequence[TaskPhrases]) -> tuple[str, tuple[str, ...]]:
    """Correct typing slips in an instruction.

    Args:
        instruction: words of the user.
        tasks: all tasks.

    Returns:
        The instruction with each word that is one slip from exactly one word of the tasks replaced, and a
        line for each. A slip is a letter left out, doubled or wrong, or two turned round; it changes neither
        the first letter nor the last alone.
    """
    known, targets = _vocabulary(tasks)
    account: dict[str, str] = {}

    def corrected(match: re.Match[str]) -> str:
        word = " ".join(normalized_words(match.group()))
        if len(word) < _MIN_TURNED or word in english.NO_SLIPS or known & english.base_forms(word):
            return match.group()
        near = [one for one in targets if _is_slip(word, one)]
        if len(near) != 1:
            return match.group()
        account[word] = near[0]
        return near[0]

    text = _WORD.sub(corrected, instruction)
    return text, tuple(f"read `{word}` as `{one}`" for word, one in account.items())


def unknown_words(instruction: str, tasks: Sequence[TaskPhrases]) -> tuple[str, ...]:
    """Find the words that neither a task nor the grammar has.

    Args:
        instruction: words of the user.
        tasks: all tasks.

    Returns:
        The words in order, each once.
    """
    known, _ = _vocabulary(tasks)
    spoken = dict.fromkeys(normalized_words(instruction))
    return tuple(
        word
        for word in spoken
        if english.number_of(word) is None
        and not known & (english.base_forms(word) | english.participle_bases(word))
    )


def _vocabulary(tasks: Sequence[TaskPhrases]) -> tuple[frozenset[str], tuple[str, ...]]:
    """Return all words that tasks or the grammar have, and those that slips are corrected to."""
    acts = {word for entry in tasks for phrase in (*entry.triggers, *entry.objects) for word in phrase}
    extras = {word for entry in tasks for phrase in entry.extras for word in phrase}
    values: set[str] = set()
    conditions: set[str] = set()
    for entry in tasks:
        task = entry.routed.task
        conditions.update(word for phrase in task.condition_phrases for word in normalized_words(phrase))
        stated = (one for parameter in task.parameters.values() for one in parameter.phrases.values())
        values.update(word for phrases in stated for text in phrases for word in normalized_words(text))
    targets = sorted(word for one in (acts | (extras - english.ALL_WORDS)) - values for word in _forms(one))
    return frozenset(acts | extras | values | conditions | english.ALL_WORDS), tuple(targets)


def _forms(word: str) -> Iterator[str]:
    """Yield a word and its plural; both are understood as the word."""
    yield word
    if not word.endswith("s"):
        yield word + "s"


def _is_slip(word: str, target: str) -> bool:
    """Return True if `word` is `target` with one typing slip."""
    if word[0] != target[0] or word == target:
        return False
    turned = (target[:at] + target[at + 1] + target[at] + target[at + 2 :] for at in range(len(target) - 1))
    if len(word) == len(target):
        if len(word) >= _MIN_TURNED and word in turned:
            return True
        different = [at for at, (one, other) in enumerate(zip(word, target, strict=True)) if one != other]
        return len(word) >= _MIN_LENGTH and len(different) == 1 and different[0] < len(word) - 1
    longer, shorter = (word, target) if len(word) > len(target) else (target, word)
    if len(longer) != len(shorter) + 1 or len(word) < _MIN_LENGTH:
        return False
    # A letter at the end makes another form: `prepared`.
    return any(longer[:at] + longer[at + 1 :] == shorter for at in range(1, len(longer) - 1))
