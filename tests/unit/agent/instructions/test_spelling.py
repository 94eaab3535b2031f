from __future__ import annotations

import pytest

from aeros.agent.instructions.lexicon import task_phrases
from aeros.agent.instructions.spelling import unknown_words, without_slips
from aeros.agent.instructions.understand import understand
from tests.unit.agent.instructions.lists.reference import parametric_modules


@pytest.mark.parametrize(
    ("spoken", "read"),
    [
        ("make dumplngs", "make dumplings"),
        ("make a dumpiing", "make a dumpling"),
        ("make dumplingss", "make dumplings"),
        ("clean the tabel", "clean the table"),
        ("delvier the can", "deliver the can"),
        ("cleen the table", "clean the table"),
        ("clean the tabl", "clean the table"),
        ("make a dumplin", "make a dumpling"),
        ("bring me the blue blok", "bring me the blue block"),
        ("brring the can", "bring the can"),
    ],
)
def test_one_slip_in_a_word_of_a_task_is_read_over(spoken: str, read: str) -> None:
    text, account = without_slips(spoken, task_phrases(parametric_modules()))
    assert text == read
    assert len(account) == 1


@pytest.mark.parametrize(
    "spoken",
    [
        "klean the table",
        "bring me the black box",
        "pack the can",
        "make the tale",
        "if the table is cleen, bring the can",
        "bring the grean cube",
        "bring me the bleu cube",
        "put it on the lefft",
        "make thre dumplings",
        "nevr clean the table",
        "donnt clean the table",
        "clean it unlss it is clean",
        "clean the cable",
        "start dumping",
        "bring it to the middel",
        "bring it to the rihgt",
        "do nto clean the table",
        "clean it unles it is clean",
        "retrieved the can",
        "¼",
    ],
)
def test_short_words_other_words_and_words_that_change_a_value_are_left(spoken: str) -> None:
    assert without_slips(spoken, task_phrases(parametric_modules())) == (spoken, ())


def test_a_slip_is_shown_in_the_account() -> None:
    meaning = understand("clean the tabel", parametric_modules())
    assert (meaning.instruction, meaning.account) == ("clean the tabel", ("read `tabel` as `table`",))


def test_words_that_nobody_has_are_found() -> None:
    tasks = task_phrases(parametric_modules())
    assert unknown_words("please clean the fridge, Bob, and two cleaned tables", tasks) == ("fridge", "bob")
