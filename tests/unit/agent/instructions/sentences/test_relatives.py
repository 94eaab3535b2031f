from __future__ import annotations

import pytest

from aeros.agent.instructions.sentences.relatives import without_relatives


@pytest.mark.parametrize(
    ("words", "plain"),
    [
        ("put the can that i asked for on the right", "put the can on the right"),
        ("bring the blue block which we mentioned", "bring the blue block"),
        ("wipe the half that is on the left", "wipe the half on the left"),
        ("bring the can that is on the left", "bring the can that is on the left"),
        ("bring the one that i asked for", "bring the one that i asked for"),
        ("bring the can i want two teas", "bring the can i want two teas"),
    ],
)
def test_clauses_that_do_not_say_which_one_are_left_out(words: str, plain: str) -> None:
    assert " ".join(without_relatives(tuple(words.split()))) == plain
