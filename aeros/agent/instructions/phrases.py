"""Sets of phrases of English, written as patterns with alternatives, and the longest phrase at a place.

    pattern      = { word | "(" alternatives ")" | "<" class ">" | "*" | "**" }
    alternatives = pattern { "|" pattern }, of which any may be empty

A class is a named list of patterns. `(i|we) need (for|) you to` is four phrases. `*` stands for one word
that is not barred, and `**` for up to `MAX_FREE`. A pattern does not begin with one of them, and one that
ends with one is not found from its end.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cached_property, lru_cache, partial
from typing import Final, TypeAlias

Words: TypeAlias = tuple[str, ...]
"""Words as `normalized_words` returns them: `don't` is the two words `don` and `t`."""

_Pattern: TypeAlias = "tuple[str | _Alternatives, ...]"
_Alternatives: TypeAlias = "tuple[_Pattern, ...]"

_TOKEN: Final = re.compile(r"\s*([(|)]|<\w+>|[^\s(|)<]+)")


_FREE: Final = ("*", "**")
MAX_FREE: Final = 7
"""Limit on the words that `**` stands for."""


class PhraseSet:
    """Set of the phrases of some patterns.

    Args:
        patterns: the patterns.
        classes: patterns of each class, by name.
        barred: words that `**` does not stand for.

    Raises:
        ValueError: from the first question: a pattern has alternatives outside of brackets.
    """

    def __init__(
        self,
        patterns: Iterable[str],
        classes: Mapping[str, Sequence[str]],
        barred: frozenset[str] = frozenset(),
    ) -> None:
        self._texts = tuple(patterns)
        self._classes = classes
        self._barred = barred

    # Parsed when first asked: most commands understand no instruction.
    @cached_property
    def _patterns(self) -> Sequence[_Pattern]:
        return [_parse(text, self._classes) for text in self._texts]

    @cached_property
    def _length_at(self) -> Callable[[Words, int], int]:
        by_first = _by_first_word(self._patterns)
        return lru_cache(maxsize=1 << 10)(partial(_longest, by_first, barred=self._barred))

    @cached_property
    def _by_last(self) -> Mapping[str, Sequence[_Pattern]]:
        return _by_first_word([_reversed(one) for one in self._patterns])

    def __contains__(self, words: Words) -> bool:
        return bool(words) and self.starting(words) == words

    def starting(self, words: Words, at: int = 0) -> Words:
        """Find the longest phrase that stands at a place.

        Args:
            words: words of an instruction.
            at: the place.

        Returns:
            The phrase; empty if none stands there.
        """
        return words[at : at + self._length_at(words, at)]

    def ending(self, words: Words) -> Words:
        """Find the longest phrase that some words end with.

        Args:
            words: words of an instruction.

        Returns:
            The phrase; empty if none ends them.
        """
        return words[len(words) - _longest(self._by_last, words[::-1], 0, self._barred) :]


def _longest(
    patterns: Mapping[str, Sequence[_Pattern]], words: Words, at: int, barred: frozenset[str]
) -> int:
    """Return the length of the longest phrase at a place; 0 if there is none."""
    if at >= len(words) or words[at] not in patterns:
        return 0
    return max((end - at for one in patterns[words[at]] for end in _ends(one, words, at, barred)), default=0)


def _ends(pattern: _Pattern, words: Words, at: int, barred: frozenset[str]) -> set[int]:
    """Return the places at which a phrase of the pattern that begins at `at` may end."""
    places = {at}
    for item in pattern:
        if item in _FREE:
            most = 1 if item == _FREE[0] else MAX_FREE
            places = {end for place in places for end in _free_ends(words, place, barred, most)}
        elif isinstance(item, str):
            places = {place + 1 for place in places if place < len(words) and words[place] == item}
        else:
            places = {end for place in places for one in item for end in _ends(one, words, place, barred)}
    return places


def _free_ends(words: Words, at: int, barred: frozenset[str], most: int) -> Iterator[int]:
    for place in range(at, min(len(words), at + most)):
        if words[place] in barred:
            return
        yield place + 1


def _by_first_word(patterns: Iterable[_Pattern]) -> Mapping[str, Sequence[_Pattern]]:
    found: dict[str, list[_Pattern]] = {}
    for one in patterns:
        for word in _first_words(one)[0]:
            found.setdefault(word, []).append(one)
    return found


def _first_words(pattern: _Pattern) -> tuple[set[str], bool]:
    """Return the words with which a phrase of the pattern may begin, and True if one may be empty."""
    first: set[str] = set()
    for item in pattern:
        if isinstance(item, str):
            return first | {item}, False
        found = [_first_words(one) for one in item]
        first |= {word for words, _ in found for word in words}
        if not any(may_be_empty for _, may_be_empty in found):
            return first, False
    return first, True


def _reversed(pattern: _Pattern) -> _Pattern:
    return tuple(
        item if isinstance(item, str) else tuple(_reversed(one) for one in item) for item in reversed(pattern)
    )


def _parse(text: str, classes: Mapping[str, Sequence[str]]) -> _Pattern:
    alternatives = _alternatives(iter(_TOKEN.findall(text)), classes)
    if len(alternatives) != 1:
        raise ValueError(f"`{text}` has alternatives outside of brackets")
    return alternatives[0]


def _alternatives(tokens: Iterator[str], classes: Mapping[str, Sequence[str]]) -> _Alternatives:
    """Read alternatives up to a closing bracket, or the end."""
    found: list[_Pattern] = []
    pattern: list[str | _Alternatives] = []
    for part in tokens:
        if part == ")":
            break
        if part == "|":
            found.append(tuple(pattern))
            pattern = []
        elif part == "(":
            pattern.append(_alternatives(tokens, classes))
        elif part.startswith("<"):
            pattern.append(tuple(_parse(text, classes) for text in classes[part[1:-1]]))
        else:
            pattern.append(part)
    return (*found, tuple(pattern))
