from __future__ import annotations

import pytest

from aeros.agent.instructions import english
from aeros.spec.diagnostics.words import normalized_words


@pytest.mark.parametrize(
    ("word", "base"),
    [
        ("clean", "clean"),
        ("cleaning", "clean"),
        ("making", "make"),
        ("wiping", "wipe"),
        ("grabbing", "grab"),
        ("tidying", "tidy"),
        ("tables", "table"),
        ("dishes", "dish"),
        ("berries", "berry"),
    ],
)
def test_plurals_and_ing_forms_stand_for_the_declared_word(word: str, base: str) -> None:
    assert base in english.base_forms(word)


@pytest.mark.parametrize(
    ("word", "other"), [("cleaned", "clean"), ("cleaner", "clean"), ("unclean", "clean"), ("glass", "glas")]
)
def test_other_forms_do_not(word: str, other: str) -> None:
    assert other not in english.base_forms(word)


@pytest.mark.parametrize(
    ("word", "number"), [("twelve", 12), ("12", 12), ("dozen", 12), ("0", 0), ("table", None), ("²", None)]
)
def test_numbers_are_read(word: str, number: int | None) -> None:
    assert english.number_of(word) == number


def test_phrases_are_normalized_and_longest_first() -> None:
    for phrases in (english.OPENERS, english.CLOSERS, english.PROHIBITIONS, english.SEQUENCE):
        assert [len(one) for one in phrases] == sorted(map(len, phrases), reverse=True)
        assert all(normalized_words(" ".join(one)) == one for one in phrases)


def test_no_word_that_changes_nothing_is_a_negative() -> None:
    assert english.NEGATIVES.isdisjoint(english.FILLERS | english.DETERMINERS | english.PRONOUNS)
