"""Typing slips: a word that is nearly one word of a task is read as that, and the reading shown.

Only words of acts, things and additions are corrected. A word for a value, a condition or a place in the
grammar is not: a slip in it may change the meaning. The noun of a thing, such as `block`, is corrected, its
colour is not. In a short word, only the slips are read over that seldom make another word of English; those
that do are listed in `english.toml`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import Final

from aeros.agent.instructions import english
from aeros.agent.instructions.arguments import is_object
from aeros.agent.instructions.lexicon import TaskPhrases, singular_objects, words_in
from aeros.agent.instructions.phrases import Words
from aeros.spec.diagnostics.words import normalized_words

_WORD: Final = re.compile(r"[^\W\d_]+")
_MIN_LENGTH: Final = 4
_MIN_LONG: Final = 6
"""Shortest word in which any letter may be wrong, or one too many."""
_FUNCTION_WORDS: Final = english.TO_PLACES | english.PARTICLES
"""Never corrected: a slip in one may change where a thing is to go."""
_VOWELS: Final = frozenset("aeiouy")


def without_slips(instruction: str, tasks: Sequence[TaskPhrases]) -> tuple[str, tuple[str, ...]]:
    """Correct typing slips in an instruction.

    Args:
        instruction: words of the user.
        tasks: all tasks.

    Returns:
        The instruction with each word that is one slip from exactly one word of the tasks replaced, and a
        line for each. A slip is a letter left out or doubled, a wrong vowel, or two letters turned round; in
        a long word, also any wrong letter, and one too many. It never changes the first letter. A word that
        is as near to one that is not corrected, such as that of a side, is left as it is.
    """
    known, targets = _vocabulary(tuple(tasks))
    states = _states(tasks)
    conditional = _conditional_at(instruction)
    account: dict[str, str] = {}

    def corrected(match: re.Match[str]) -> str:
        word = " ".join(normalized_words(match.group()))
        if len(word) < _MIN_LENGTH or word in english.NO_SLIPS or known & english.base_forms(word):
            return match.group()
        near = {one for one in known.union(targets) if len(one) >= _MIN_LENGTH and _is_slip(word, one)}
        if len(near) != 1 or not near.issubset(targets):
            return match.group()
        if near & states and match.start() > conditional:
            return match.group()  # in `if it is cleen`, it decides
        account[word] = min(near)
        return account[word]

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
    known, _ = _vocabulary(tuple(tasks))
    spoken = dict.fromkeys(normalized_words(instruction))
    return tuple(
        word
        for word in spoken
        if english.number_of(word) is None
        and not known & (english.base_forms(word) | english.participle_bases(word))
    )


def _states(tasks: Sequence[TaskPhrases]) -> frozenset[str]:
    """Return the last words of all conditions: `clean` of `the table is clean`, and their forms."""
    phrases = (phrase for entry in tasks for phrase in entry.routed.task.condition_phrases)
    return frozenset(form for one in phrases for form in _forms(normalized_words(one)[-1]))


def _conditional_at(instruction: str) -> int:
    """Return where the first condition begins; the length of the instruction if it has none."""
    words = tuple(_WORD.finditer(instruction))
    spoken = tuple(match.group().lower() for match in words)
    places = (at for at in range(len(spoken)) if spoken[at] == "should" or _begins_condition(spoken, at))
    return next((words[at].start() for at in places), len(instruction))


def _begins_condition(spoken: Words, at: int) -> bool:
    phrases = (english.CONDITIONALS, english.TIME_CONDITIONALS, english.CHECKS)
    return any(one.starting(spoken, at) for one in phrases)


@lru_cache(maxsize=8)
def _vocabulary(tasks: tuple[TaskPhrases, ...]) -> tuple[frozenset[str], tuple[str, ...]]:
    """Return all words that tasks or the grammar have, and those that slips are corrected to."""
    acts = {word for entry in tasks for word in _act_words(entry.triggers) | words_in(entry.objects)}
    extras = {word for entry in tasks for word in words_in(entry.extras)}
    conditions = {
        word
        for entry in tasks
        for phrase in entry.routed.task.condition_phrases
        for word in normalized_words(phrase)
    }
    values = {word for entry in tasks for value in entry.values for word in value.words}
    values -= {word for entry in tasks for word in words_in(entry.objects)}
    corrected = ((acts | (extras - english.ALL_WORDS)) - values - _FUNCTION_WORDS) | _things(tasks)
    targets = sorted(word for one in corrected if len(one) >= _MIN_LENGTH for word in _forms(one))
    # `sort a bolt` is no slip for `sort bolts`, which asks for all of them.
    one_of_all = {phrase[-1] for entry in tasks for phrase in singular_objects(entry)}
    known = acts | extras | values | conditions | one_of_all | english.ALL_WORDS
    return frozenset(known), tuple(targets)


@lru_cache(maxsize=1 << 8)
def _act_words(triggers: tuple[Words, ...]) -> frozenset[str]:
    """Return the words of acts, but for those of wishes such as `i would like`."""
    return words_in(tuple(one for one in triggers if one[0] not in ("i", "we")))


def _things(tasks: Sequence[TaskPhrases]) -> frozenset[str]:
    """Return the nouns of the objects that parameters stand for: `block` of `blue block`."""
    parameters = (one for entry in tasks for one in entry.routed.task.parameters.values() if is_object(one))
    phrases = (text for one in parameters for texts in one.phrases.values() for text in texts)
    return frozenset(normalized_words(text)[-1] for text in phrases)


def _forms(word: str) -> Iterator[str]:
    """Yield a word and its plural; both are understood as the word."""
    yield word
    if not word.endswith("s"):
        yield word + "s"


def _is_slip(word: str, target: str) -> bool:
    """Return True if `word` is `target` with one typing slip."""
    if word[0] != target[0] or word == target:
        return False
    is_long = len(word) >= _MIN_LONG
    if len(word) == len(target):
        different = [at for at, (one, other) in enumerate(zip(word, target, strict=True)) if one != other]
        first, last = different[0], different[-1]
        if len(different) == 2 and last == first + 1:
            return word[first] == target[last] and word[last] == target[first]
        is_vowel = word[first] in _VOWELS and target[first] in _VOWELS
        return len(different) == 1 and first < len(word) - 1 and (is_long or is_vowel)
    if len(word) == len(target) - 1:
        return any(target[:at] + target[at + 1 :] == word for at in range(1, len(target)))
    # A letter more at the end makes another form: `prepared`.
    return len(word) == len(target) + 1 and any(
        word[:at] + word[at + 1 :] == target and (is_long or word[at] == word[at - 1])
        for at in range(1, len(word) - 1)
    )
