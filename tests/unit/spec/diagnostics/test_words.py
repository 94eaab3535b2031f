"""Words are the same however they are written."""

from __future__ import annotations

import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.diagnostics.words import expanded, normalized_words


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", ()),
        (" \t.,-", ()),
        ("Make two dumplings, please!", ("make", "two", "dumplings", "please")),
        ("pick-up 3x the_cup", ("pick", "up", "3x", "the_cup")),
        ("STRASSE Straße", ("strasse", "strasse")),
        ("café", ("caf\u00e9",)),
        ("cafe\u0301", ("caf\u00e9",)),
        ("\ufb01ne ① ２", ("fine", "1", "2")),
        ("हिन्दी शब्द", ("हिन्दी", "शब्द")),
        ("don't", ("don", "t")),
    ],
)  # fmt: skip
def test_text_is_split_into_words(text: str, words: tuple[str, ...]) -> None:
    assert normalized_words(text) == words


@given(st.text())
def test_words_are_the_same_however_the_text_is_composed_and_split_no_further(text: str) -> None:
    words = normalized_words(text)
    assert normalized_words(unicodedata.normalize("NFD", text)) == words
    assert normalized_words(" ".join(words)) == words


@pytest.mark.parametrize(
    ("text", "phrases"),
    [
        ("to me", ("to me",)),
        ("to (the) tray", ("to the tray", "to tray")),
        ("(very) (very) well", ("very very well", "very well", "very well", "well")),
        ("(to me)", ("to me", "")),
        ("to (the tray", ()),
        ("to the) tray", ()),
        ("to ((the) big) tray", ()),
        ("to () tray", ()),
        (
            "clear (dirt|the mess) (up)",
            ("clear dirt up", "clear dirt", "clear the mess up", "clear the mess"),
        ),
        ("wipe (up|)", ("wipe up", "wipe")),
        ("wipe (|up)", ()),
        ("wipe (|)", ()),
        ("clear | up", ()),
        ("a" + " (b)" * 10, ()),
    ],
)
def test_bracketed_words_are_optional_or_alternatives(text: str, phrases: tuple[str, ...]) -> None:
    assert expanded(text) == phrases
