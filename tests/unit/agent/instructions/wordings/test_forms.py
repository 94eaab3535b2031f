from __future__ import annotations

import pytest

from aeros.agent.instructions.wordings.forms import wordings
from aeros.agent.instructions.wordings.wording import Wording


@pytest.mark.parametrize(
    ("words", "plain"),
    [
        ("have the table cleaned", "the table cleaned"),
        ("i want the table to be cleaned", "the table cleaned"),
        ("make the table clean", "the table clean"),
        ("get a dumpling cooking", "a dumpling cooking"),
        ("the table must be cleaned", "the table cleaned"),
        ("the table needs a good wipe", "the table wipe"),
        ("give the table a quick wipe", "the table a wipe"),
    ],
)
def test_an_object_before_its_verb_is_a_request_in_other_words(words: str, plain: str) -> None:
    found = list(wordings(tuple(words.split()), is_polite=False, is_perfect=False))
    assert found[0] == Wording(tuple(words.split()))
    assert tuple(plain.split()) in [one.words for one in found if one.needs_object_first]


@pytest.mark.parametrize(
    ("words", "wish"),
    [
        ("may i have a dumpling", "i want a dumpling"),
        ("some dumplings would be lovely", "i want some dumplings"),
        ("whip me up a dumpling", "whip up me a dumpling"),
    ],
)
def test_a_wish_is_one_in_plain_words(words: str, wish: str) -> None:
    found = wordings(tuple(words.split()), is_polite=False, is_perfect=False)
    assert tuple(wish.split()) in [one.words for one in found]


def test_a_thing_alone_is_wished_for_only_with_please() -> None:
    wish = ("i", "want", "the", "can")
    assert wish in [one.words for one in wordings(wish[2:], is_polite=True, is_perfect=False)]
    assert wish not in [one.words for one in wordings(wish[2:], is_polite=False, is_perfect=False)]


def test_one_class_of_english_may_stand_in_another() -> None:
    words = ("what", "i", "want", "is", "the", "can", "of", "red", "colour")
    forms = [one.words for one in wordings(words, is_polite=False, is_perfect=False)]
    assert ("i", "want", "the", "red", "can") in forms


def test_a_request_goes_on_with_the_words_of_the_one_before() -> None:
    forms = wordings(("a", "tea", "made"), is_polite=False, is_perfect=False, carried=(("have",),))
    assert ("have", "a", "tea", "made") in [one.words for one in forms]


def test_the_forms_of_any_text_are_few() -> None:
    endless = ("have", "to", "get", "the", "up", "given", "a", "wipe", "that", "is", "red", "of", "red") * 12
    assert len(list(wordings(endless, is_polite=True, is_perfect=True))) <= 60
