from __future__ import annotations

import pytest

from aeros.agent.instructions.reasons.statements import is_statement


@pytest.mark.parametrize(
    "words",
    [
        "we spilled some juice",
        "my back hurts",
        "my friend and i are hungry",
        "guests are coming",
        "dinner is over",
        "this table is filthy",
        "my son wants the red can",
        "i can t reach it",
        "there is a mess",
        "the audit team wants to see the process",
    ],
)
def test_a_subject_with_a_finite_verb_states_something(words: str) -> None:
    assert is_statement(tuple(words.split()))


@pytest.mark.parametrize(
    "words",
    [
        "clean the table",
        "please have the table cleaned",
        "that table",
        "the table",
        "the red can",
        "i want the table cleaned",
        "the machine wants to see the process",
        "the team wants to have the table cleaned",
        "i would hate that",
        "the table must stay dirty",
        "the table needs a wipe",
        "my mother says",
        "the plan is this",
        "i am joking",
        "dumplings are not needed",
        "you cleaned it",
        "let s go",
        "who is there",
    ],
)
def test_requests_reports_and_words_about_words_are_no_statements(words: str) -> None:
    assert not is_statement(tuple(words.split()))
