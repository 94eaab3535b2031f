from __future__ import annotations

import pytest

from aeros.agent.instructions.reasons.statements import is_remark, is_statement


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


@pytest.mark.parametrize(
    "words",
    [
        "what a morning",
        "my back is not what it was",
        "it is necessary for my work",
        "my guests are about to arrive",
        "i have been up since dawn",
        "the kids spilled juice",
    ],
)
def test_a_remark_cannot_take_back_what_is_asked_for(words: str) -> None:
    assert is_remark(tuple(words.split()))


@pytest.mark.parametrize(
    "words",
    [
        "i did it",
        "i take that back",
        "i am only kidding",
        "my wife took care of it",
        "my sister will do it",
        "she shouted",
        "we are good",
        "it is in the fridge",
        "it is the neighbour s",
        "it is yellow",
        "the can is behind the sofa",
        "my son wants the red can",
    ],
)
def test_words_that_may_take_it_back_or_name_another_thing_are_no_remark(words: str) -> None:
    assert not is_remark(tuple(words.split()))
