from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.agent.instructions.phrases import PhraseSet
from tests.hypothesis_profiles import examples

PHRASES = PhraseSet(
    ["(i|we) need (for|) you to", "a", "a b", "<polite> (now|)"], {"polite": ["please", "if (you|i) may"]}
)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("we need you to go", "we need you to"),
        ("i need for you to", "i need for you to"),
        ("i need to", ""),
        ("a b c", "a b"),
        ("a c", "a"),
        ("please now", "please now"),
        ("if i may go", "if i may"),
        ("", ""),
    ],
)
def test_the_longest_phrase_at_a_place_is_found(text: str, found: str) -> None:
    assert " ".join(PHRASES.starting(tuple(text.split()))) == found


@pytest.mark.parametrize(
    ("text", "found"), [("go please now", "please now"), ("x a b", "a b"), ("b", ""), ("now", ""), ("", "")]
)
def test_the_longest_phrase_at_the_end_is_found(text: str, found: str) -> None:
    assert " ".join(PHRASES.ending(tuple(text.split()))) == found


def test_a_phrase_is_in_the_set_only_as_a_whole() -> None:
    assert ("a", "b") in PHRASES
    assert ("a", "b", "c") not in PHRASES
    assert () not in PHRASES


def test_alternatives_stand_in_brackets() -> None:
    with pytest.raises(ValueError, match="outside of brackets"):
        PhraseSet(["a|b"], {}).starting(("a",))


_WORDS = {"i", "we", "need", "for", "you", "to", "a", "b", "please", "if", "may", "now"}


@examples(100)
@given(st.lists(st.sampled_from(sorted(_WORDS)), max_size=7))
def test_an_end_is_found_iff_a_start_reaches_it(words: list[str]) -> None:
    spoken = tuple(words)
    ends = [at for at in range(len(spoken)) if spoken[at:] in PHRASES]
    expected = spoken[min(ends) :] if ends else ()
    assert PHRASES.ending(spoken) == expected


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("be a star and go", "be a star and"),
        ("be a no and go", ""),
        ("what a long day it was no", "what a long day it was"),
        ("what a", ""),
        ("what a b c d e f g h i", "what a b c d e f g h"),
    ],
)
def test_free_words_are_not_barred_and_at_most_seven(text: str, found: str) -> None:
    phrases = PhraseSet(["be a * and", "what a **"], {}, frozenset({"no"}))
    assert " ".join(phrases.starting(tuple(text.split()))) == found
