"""Closed classes of English words that an instruction may use around the phrases that modules declare.

Every other word of an instruction must be declared by the task that it asks for; otherwise the instruction is
refused. So the lists of `english.toml` may be short: a missing word costs a refusal, and never a motion.
"""

from __future__ import annotations

import tomllib
from importlib.resources import files
from typing import Any, Final

Words = tuple[str, ...]
"""Words as `normalized_words` returns them: `don't` is the two words `don` and `t`."""

_DATA: Final[dict[str, Any]] = tomllib.loads(
    files(__package__).joinpath("english.toml").read_text(encoding="utf-8")
)


def _words(name: str) -> frozenset[str]:
    return frozenset(_DATA[name])


def _phrases(name: str) -> tuple[Words, ...]:
    """Return phrases as words, longest first, so that the longest match is found first."""
    return tuple(sorted((tuple(text.split()) for text in _DATA[name]), key=len, reverse=True))


# The comments in `english.toml` describe each list.
DETERMINERS: Final = _words("determiners")
FILLERS: Final = _words("fillers")
PRONOUNS: Final = _words("pronouns")
NEGATIVES: Final = _words("negatives")
UNIVERSAL: Final = _words("universal")
QUESTIONS: Final = _words("questions")
CHOICES: Final = _words("choices")
REPETITIONS: Final = _words("repetitions")
OPENERS: Final = _phrases("openers")
SENTENCE_OPENERS: Final = _phrases("sentence_openers")
CLOSERS: Final = _phrases("closers")
SEQUENCE: Final = _phrases("sequence")
REVERSED: Final = _phrases("reversed")
PROHIBITIONS: Final = _phrases("prohibitions")
CONDITIONALS: Final = _phrases("conditionals")
TIME_CONDITIONALS: Final = _phrases("time_conditionals")
NEW_REQUEST: Final = _phrases("new_request")
PERFECT: Final = frozenset(_phrases("perfect"))
ABILITY: Final = _phrases("ability")
LEADING: Final = _phrases("leading")
LABELS: Final = frozenset(_phrases("labels"))
_PARTICIPLES: Final[dict[str, str]] = _DATA["participles"]
_NUMBERS: Final[dict[str, int]] = _DATA["numbers"]


def number_of(word: str) -> int | None:
    """Read a number word or numeral.

    Args:
        word: one normalized word.

    Returns:
        The number; None if it is none.
    """
    if word.isascii() and word.isdigit():
        return int(word[:18])
    return _NUMBERS.get(word)


def participle_bases(word: str) -> frozenset[str]:
    """List the verbs that `word` may be the past participle of.

    Args:
        word: one normalized word.

    Returns:
        Candidates; empty if it is no participle.
    """
    if word in _PARTICIPLES:
        return frozenset({_PARTICIPLES[word]})
    if not word.endswith("ed") or len(word) < 4:
        return frozenset()
    stem = word[:-2]
    forms = {stem, stem + "e"}
    if stem.endswith("i"):
        forms.add(stem[:-1] + "y")
    if stem[-1] == stem[-2]:
        forms.add(stem[:-1])
    return frozenset(forms)


def base_forms(word: str) -> frozenset[str]:
    """List the words that `word` may be a form of: itself, a singular, the verb of an -ing form.

    Past tenses are no forms of a request, and are left out.

    Args:
        word: one normalized word.

    Returns:
        Candidates, `word` among them; most of them are no words of English.
    """
    forms = {word}
    if word.endswith("s") and not word.endswith("ss") and len(word) > 2:
        forms.add(word[:-1])
        if word.endswith("es") and len(word) > 3:
            forms.add(word[:-2])
        if word.endswith("ies") and len(word) > 4:
            forms.add(word[:-3] + "y")
    if word.endswith("ing") and len(word) > 4:
        stem = word[:-3]
        forms |= {stem, stem + "e"}
        if stem.endswith("y"):
            forms.add(stem[:-1] + "ie")
        if len(stem) > 2 and stem[-1] == stem[-2]:
            forms.add(stem[:-1])
    return frozenset(forms)
