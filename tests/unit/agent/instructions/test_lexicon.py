from __future__ import annotations

from dataclasses import replace

import pytest

from aeros.agent.instructions.lexicon import Coverage, task_phrases
from tests.unit.agent.dumplings import module, task

TEA = replace(
    task("tea", ("make", "brew up"), "wrapper_aligned"),
    object_phrases=("tea", "green tea"),
    extra_phrases=("for two",),
)


def cover(words: str, *, knows_pronoun: bool = False) -> Coverage:
    (entry,) = task_phrases({"kitchen": module("kitchen", (), TEA)})
    return entry.cover(tuple(words.split()), knows_pronoun=knows_pronoun)


@pytest.mark.parametrize(
    "words", ["make tea", "brew up the green teas", "making one tea", "tea brewing up", "make tea for two"]
)
def test_words_that_are_all_declared_are_covered_whole(words: str) -> None:
    assert cover(words).is_whole


@pytest.mark.parametrize(
    ("words", "left"),
    [
        ("make black tea", ("black",)),
        ("make tea for three", ("for",)),
        ("brew tea", ("brew",)),
        ("make tea in a red pot", ("in", "red", "pot")),
    ],
)
def test_words_that_nothing_declares_are_left_over(words: str, left: tuple[str, ...]) -> None:
    coverage = cover(words)
    assert (coverage.unknown, coverage.is_whole) == (left, False)


def test_a_verb_alone_needs_an_object_and_an_object_a_verb() -> None:
    assert not cover("make").is_whole
    assert not cover("tea").is_whole
    assert cover("make it", knows_pronoun=True).is_whole
    assert not cover("make it").is_whole


def test_numbers_and_repetitions_are_kept_apart() -> None:
    assert cover("make two tea").counts == ("two",)
    assert cover("make tea one").counts == ("one",)
    assert cover("make tea twice").repetitions == ("twice",)
