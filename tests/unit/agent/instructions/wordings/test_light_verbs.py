from __future__ import annotations

import pytest

from aeros.agent.instructions.wordings.light_verbs import given_acts
from aeros.agent.instructions.wordings.wording import Wording


@pytest.mark.parametrize(
    ("words", "other"),
    [
        ("give the table a good wipe", "the table a wipe"),
        ("clear the table give it a wipe", "clear the table it a wipe"),
    ],
)
def test_words_are_read_in_another_form(words: str, other: str) -> None:
    found = given_acts(Wording(tuple(words.split())))
    assert other in [" ".join(one.words) for one in found]


def test_other_words_have_no_other_form() -> None:
    assert list(given_acts(Wording(("fetch", "the", "can")))) == []
