from __future__ import annotations

import pytest

from aeros.agent.instructions.wordings.causatives import causatives, duties
from aeros.agent.instructions.wordings.wording import Wording


@pytest.mark.parametrize(
    ("words", "other"),
    [
        ("have the table cleaned", "the table cleaned"),
        ("make the table nice and clean", "the table clean"),
        ("make clean the table", "the table clean"),
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


@pytest.mark.parametrize(
    ("words", "other"),
    [
        ("the table should be wiped", "the table wiped"),
        ("the can needs to go to the left side", "the can to the left side"),
        ("the can has to go on the tray", "the can to the tray"),
    ],
)
def test_a_duty_is_read_without_its_verb(words: str, other: str) -> None:
    assert other in [" ".join(one.words) for one in duties(Wording(tuple(words.split())))]


@pytest.mark.parametrize("words", ["the can must not go to the left side", "the can goes to the left side"])
def test_a_prohibition_or_a_statement_is_no_duty(words: str) -> None:
    assert list(duties(Wording(tuple(words.split())))) == []
