from __future__ import annotations

import pytest

from aeros.agent.instructions.wordings.causatives import causatives
from aeros.agent.instructions.wordings.wording import Wording


@pytest.mark.parametrize(
    ("words", "other"),
    [
        ("have the table cleaned", "the table cleaned"),
        ("make the table nice and clean", "the table clean"),
        ("see that the table gets a wipe", "the table wipe"),
        ("i want a clean table", "a clean table"),
        ("i would be glad if the table were wiped", "the table wiped"),
    ],
)
def test_words_are_read_in_another_form(words: str, other: str) -> None:
    found = causatives(Wording(tuple(words.split())))
    assert other in [" ".join(one.words) for one in found]


def test_other_words_have_no_other_form() -> None:
    assert list(causatives(Wording(("fetch", "the", "can")))) == []
