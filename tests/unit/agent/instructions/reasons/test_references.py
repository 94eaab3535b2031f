"""A pronoun stands for what a reason names, but not for what only says where another thing is."""

from __future__ import annotations

import pytest

from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.understand import understand
from tests.unit.agent.instructions.lists.reference import parametric_modules


@pytest.mark.parametrize(
    ("text", "task"),
    [
        ("the left side of the table is sticky, please wipe it", "clean_table"),
        ("there is jam all over the table. wipe it", "clean_table"),
        ("we have guests and the table is dirty. clean it", "clean_table"),
        ("my daughter would like to play with the block, so please bring it", "fetch_object"),
        ("i can't reach the block, could you get it?", "fetch_object"),
    ],
)
def test_it_is_what_the_reason_names(text: str, task: str) -> None:
    assert [one.routed.task.id for one in understand(text, parametric_modules()).errands] == [task]


@pytest.mark.parametrize(
    "text",
    [
        "the lamp by the table is dirty. clean it",
        "the chairs around the table are dirty. clean them",
        "the table and the floor are dirty. clean it",
        "the floor and the table are dirty. clean it",
        "my ring fell behind the can. bring it",
        "i can't reach the lid of the can, could you get it?",
        "there is a can, there is a block. bring it",
        "some tables are dirty. clean them",
        "the table upstairs is dirty. clean it",
    ],
)
def test_the_word_it_is_refused_after_a_thing_that_is_named_beside_another(text: str) -> None:
    with pytest.raises(InstructionError):
        understand(text, parametric_modules())
