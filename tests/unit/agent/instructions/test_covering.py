from __future__ import annotations

from dataclasses import replace

import pytest

from aeros.agent.instructions.coverage import Coverage
from aeros.agent.instructions.covering import cover as cover_words
from aeros.agent.instructions.lexicon import task_phrases
from tests.unit.agent.dumplings import module, task
from tests.unit.agent.instructions.lists.reference import parametric_modules

TEA = replace(
    task("tea", ("make", "brew up"), "wrapper_aligned"),
    object_phrases=("tea", "green tea"),
    extra_phrases=("for two",),
)


def cover(words: str, *, knows_pronoun: bool = False) -> Coverage:
    (entry,) = task_phrases({"kitchen": module("kitchen", (), TEA)})
    return cover_words(entry, tuple(words.split()), knows_pronoun=knows_pronoun)


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


@pytest.mark.parametrize(
    ("words", "unknown"),
    [
        ("clean the dirty table", ()),
        ("clean all of the table", ()),
        ("clean all tables", ("all",)),
        ("clean the table s left half", ()),
        ("clean the table s legs", ("s", "legs")),
        ("clean the table on the left half", ()),
        ("clean under the table", ("under",)),
        ("clean the table thoroughly and gently up", ("and",)),
        ("clean the table weekly", ("weekly",)),
        ("use the sponge to wipe the table", ()),
        ("wipe him the table", ()),
        ("the cleaning procedure for the table", ()),
    ],
)
def test_words_around_an_object_are_covered_only_where_they_change_nothing(
    words: str, unknown: tuple[str, ...]
) -> None:
    entry = next(one for one in task_phrases(parametric_modules()) if one.routed.task.id == "clean_table")
    assert cover_words(entry, tuple(words.split()), knows_pronoun=False).unknown == unknown


@pytest.mark.parametrize(
    ("words", "count"),
    [
        ("make two dumplings", 2),
        ("make a couple of dumplings", 2),
        ("make two of those dumplings", 2),
        ("make dumplings quantity 2", 2),
        ("make dumplings with a count of two", 2),
        ("make dumplings two of them", 2),
        ("make dumplings x2", 2),
        ("make a dumpling", None),
    ],
)
def test_a_number_may_stand_where_a_person_puts_it(words: str, count: int | None) -> None:
    entry = next(one for one in task_phrases(parametric_modules()) if one.routed.task.id == "make_dumplings")
    coverage = cover_words(entry, tuple(words.split()), knows_pronoun=False)
    assert coverage.is_whole
    assert coverage.values.stated.get("count") == count
