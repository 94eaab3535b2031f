"""Articles before names, and nouns after numbers."""

from __future__ import annotations

import pytest

from aeros.spec.diagnostics.grammar import an, counted


@pytest.mark.parametrize(
    ("name", "phrase"),
    [
        ("move", "a `move`"),
        ("approach", "an `approach`"),
        ("Open", "an `Open`"),
        ("unlock", "an `unlock`"),
        ("unit", "a `unit`"),
        ("use_tool", "a `use_tool`"),
        ("hour", "an `hour`"),
        ("", "a ``"),
    ],
)
def test_the_article_is_that_of_the_sound(name: str, phrase: str) -> None:
    assert an(name) == phrase


@pytest.mark.parametrize(
    ("number", "noun", "phrase"),
    [
        (0, "rule", "0 rules"),
        (1, "rule", "1 rule"),
        (2, "rule", "2 rules"),
        (1, "retry", "1 retry"),
        (2, "retry", "2 retries"),
        (2, "delay", "2 delays"),
    ],
)
def test_one_thing_is_in_the_singular(number: int, noun: str, phrase: str) -> None:
    assert counted(number, noun) == phrase
