from __future__ import annotations

import pytest

from aeros.agent.instructions.sentences.names import without_names

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
        ("One for Mia and one for Tom.", "One for her and one for her."),
        ("A dumpling for Mrs Miller, please.", "A dumpling for her, please."),
        ("Clean the table. Kind regards, Laura", "Clean the table. Kind regards"),
        ("Make dumplings for Mia and Friday.", "Make dumplings for Mia and Friday."),
    ],
)
def test_a_word_with_a_capital_is_a_name_where_a_person_may_be_named(text: str, plain: str) -> None:
    found, account = without_names(text, KNOWN.__contains__)
    assert found == plain
    assert bool(account) == (text != plain)
