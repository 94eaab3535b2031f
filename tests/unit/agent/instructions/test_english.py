from __future__ import annotations

import re
import tomllib
from pathlib import Path

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


def test_every_word_of_every_pattern_is_normalized() -> None:
    data = tomllib.loads((Path(english.__file__).parent / "english.toml").read_text(encoding="utf-8"))
    lists = [one for one in (*data.values(), *data["classes"].values()) if isinstance(one, list)]
    for text in (pattern for patterns in lists for pattern in patterns):
        words = re.sub(r"<\w+>|[(|)]", " ", text)
        spoken = tuple(word for word in words.split() if word not in ("*", "**"))
        assert spoken == normalized_words(words), text


@pytest.mark.parametrize(
    ("spoken", "corrected"), [("plese clean", "please clean"), ("claen the tabel", "claen the tabel")]
)
def test_courtesy_alone_is_respelt(spoken: str, corrected: str) -> None:
    assert english.respelt(tuple(spoken.split())) == tuple(corrected.split())


def test_no_word_that_changes_nothing_is_a_negative() -> None:
    assert english.NEGATIVES.isdisjoint(english.FILLERS | english.DETERMINERS | english.PRONOUNS)


@pytest.mark.parametrize("phrases", ["OPENERS", "CLOSERS", "FREE_REMARKS", "ASIDES", "FILLERS"])
def test_no_negation_is_a_word_that_changes_nothing(phrases: str) -> None:
    # `skip` was also a form of address, so `clean the table, skip` cleaned it.
    silent = getattr(english, phrases)
    assert [word for word in english.NEGATIVES if word in silent or (word,) in silent] == []
