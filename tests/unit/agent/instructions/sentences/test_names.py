from __future__ import annotations

import pytest

from aeros.agent.instructions.lexicon import task_phrases
from aeros.agent.instructions.sentences.names import form_of_address, without_names
from tests.unit.agent.instructions.lists.reference import parametric_modules

KNOWN = frozenset({"robot", "table", "me", "guests"})


@pytest.mark.parametrize(
    ("text", "plain"),
    [
        ("Make a dumpling for Mia.", "Make a dumpling for her."),
        ("Two dumplings for Mia and Tom, please.", "Two dumplings for them, please."),
        ("Hey Robbie, clean it.", "Hey robot, clean it."),
        ("Could you clean the table, Robbie?", "Could you clean the table?"),
        ("Clean the table, Robbie, and cook.", "Clean the table, Robbie, and cook."),
        ("Clean the table, Abort.", "Clean the table, Abort."),
        ("Could you clean the table, Halt?", "Could you clean the table, Halt?"),
        ("Leave Leo's block alone.", "Leave my block alone."),
        ("Make a dumpling for Friday.", "Make a dumpling for Friday."),
        ("Make a dumpling for Guests.", "Make a dumpling for Guests."),
        ("make a dumpling for lunch.", "make a dumpling for lunch."),
        ("Make dumplings for Mia and Friday.", "Make dumplings for Mia and Friday."),
    ],
)
def test_a_word_with_a_capital_is_a_name_where_a_person_may_be_named(text: str, plain: str) -> None:
    found, account = without_names(text, KNOWN.__contains__)
    assert found == plain
    assert bool(account) == (text != plain)


@pytest.mark.parametrize(
    ("text", "address"),
    [
        ("Bhaiya, wipe the table.", "Bhaiya"),
        ("Righto old mucker! Wipe the table.", "Righto old mucker"),
        ("Coffee, wipe the table.", ""),
        ("Tomorrow, wipe the table.", ""),
        ("Hypothetically, wipe the table.", ""),
        ("Upstairs, wipe the table.", ""),
        ("Abort, wipe the table.", ""),
        ("She goes, wipe the table.", ""),
        ("A latte, wipe the table.", ""),
        ("Cushions, and wipe the table.", ""),
        ("Left, wipe the table.", ""),
        ("Bhaiya wipe the table.", ""),
    ],
)
def test_words_before_the_first_pause_are_a_form_of_address_if_they_can_be_nothing_else(
    text: str, address: str
) -> None:
    found, rest = form_of_address(text, task_phrases(parametric_modules()))
    assert found == address
    assert rest == ("" if not address else "Wipe the table." if "!" in text else "wipe the table.")
