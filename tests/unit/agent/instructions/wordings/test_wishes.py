from __future__ import annotations

import pytest

from aeros.agent.instructions.wordings.wishes import wishes
from aeros.agent.instructions.wordings.wording import Wording


@pytest.mark.parametrize(
    ("words", "other"),
    [
        ("may i have a dumpling", "i want a dumpling"),
        ("dumplings would be nice", "i want dumplings"),
        ("how about two dumplings", "i want two dumplings"),
        ("make it two dumplings", "i want two dumplings"),
        ("i ll take two dumplings", "i want two dumplings"),
        ("the can is what i need", "i want the can"),
    ],
)
def test_words_are_read_in_another_form(words: str, other: str) -> None:
    found = wishes(Wording(tuple(words.split())))
    assert other in [" ".join(one.words) for one in found]


@pytest.mark.parametrize("words", ["fetch the can", "i ll take the can", "how about the can"])
def test_other_words_have_no_other_form(words: str) -> None:
    assert list(wishes(Wording(tuple(words.split())))) == []
