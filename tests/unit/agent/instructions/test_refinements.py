from __future__ import annotations

import pytest

from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.understand import understand
from tests.unit.agent.instructions.lists.reference import parametric_modules


def asked(text: str) -> list[str]:
    errands = understand(text, parametric_modules()).errands
    return [" ".join(str(value) for value in one.routed.arguments.values()) for one in errands]


@pytest.mark.parametrize(
    ("text", "arguments"),
    [
        ("fetch the can and put it on the left", ["red_can left"]),
        ("take the block. Put it on the left.", ["blue_block left"]),
        ("bring me the can, then put it on the left", ["red_can anywhere", "red_can left"]),
        ("bring me the can. Put it on the left.", ["red_can left"]),
        ("make one dumpling, not two", ["1"]),
        ("make two dumplings, not one", ["2"]),
        ("put the can on the left, not the right", ["red_can left"]),
        ("clean the table, but only the left half", ["left"]),
        ("clean the left half, then the right half", ["left", "right"]),
        ("I'd love a dumpling, could you make one?", ["1"]),
        ("I'd love dumplings. Could you make two?", ["2"]),
        ("bring me the block, the blue one", ["blue_block anywhere"]),
        ("bring me the can and the block", ["red_can anywhere", "blue_block anywhere"]),
        ("wipe the table, then check that it is clean", ["whole"]),
        ("bring the can and the block to the left", ["red_can left", "blue_block left"]),
        ("bring the can and put the block to the left", ["red_can anywhere", "blue_block left"]),
    ],
)
def test_a_request_that_says_more_about_the_one_before_is_no_second_one(
    text: str, arguments: list[str]
) -> None:
    assert asked(text) == arguments


@pytest.mark.parametrize(
    "text", ["bring the can to the left and the block", "bring the can, the block to the left"]
)
def test_a_place_of_which_it_is_not_clear_whose_it_is_is_refused(text: str) -> None:
    with pytest.raises(InstructionError, match="of both"):
        asked(text)


@pytest.mark.parametrize(
    "text",
    [
        "make dumplings, not too many",
        "make two dumplings, not two",
        "bring the can, not left",
        "put the can on the left, not the left",
        "wipe the left half, not the table",
    ],
)
def test_a_negation_of_what_is_not_stated_is_no_contrast(text: str) -> None:
    with pytest.raises(InstructionError):
        asked(text)
