from __future__ import annotations

import pytest

from aeros.agent.instructions.wordings.word_order import attributes
from aeros.agent.instructions.wordings.wording import Wording


@pytest.mark.parametrize(
    ("words", "other"),
    [
        ("bring the can of red colour", "bring the red can"),
        ("bring the block that is blue", "bring the blue block"),
        ("bring the block which s blue", "bring the blue block"),
    ],
)
def test_words_are_read_in_another_form(words: str, other: str) -> None:
    found = attributes(Wording(tuple(words.split())))
    assert other in [" ".join(one.words) for one in found]


def test_other_words_have_no_other_form() -> None:
    assert list(attributes(Wording(("fetch", "the", "can")))) == []
