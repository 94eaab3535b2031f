from __future__ import annotations

import pytest

from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.understand import understand
from tests.unit.agent.instructions.lists.reference import parametric_modules

LEFT, RIGHT = "clean_table.clean_table(region = left)", "clean_table.clean_table(region = right)"
TWO = "make_dumplings.make_dumplings(count = 2)"
BLOCK_LEFT = "fetch_object.fetch_object(object = blue_block, to = left)"
BLOCK = "fetch_object.fetch_object(object = blue_block, to = anywhere)"


@pytest.mark.parametrize(
    ("text", "asked_for"),
    [
        ("wipe the left, sorry, the right half of the table", [RIGHT]),
        ("clean the right half, no wait, the left half", [LEFT]),
        ("Clean the right half of the table. No, I mean the left half.", [LEFT]),
        ("make one, er, sorry, two dumplings", [TWO]),
        ("make a dumpling, no, make that two", [TWO]),
        ("clean the left half uh sorry the right half", [RIGHT]),
        ("bring the can uh actually bring the block", [BLOCK]),
        ("bring me the can no the block", [BLOCK]),
        ("make one dumpling, on second thought, make two", [TWO]),
        ("make one dumpling, no, two, please", [TWO]),
        ("clean the table, no, make two dumplings", [TWO]),
        ("fetch the red can to the left, no, the blue block", [BLOCK_LEFT]),
        ("get me the can, no, scratch that, the blue block, on the left, please", [BLOCK_LEFT]),
        ("fetch the beer to the left, no, the blue block", [BLOCK_LEFT]),
        ("make two dumplings, then bring the can, no, the block", [TWO, BLOCK]),
        ("wipe the left half, no, the right, I mean, the left", [LEFT]),
    ],
)
def test_a_correction_changes_what_it_states_and_nothing_else(text: str, asked_for: list[str]) -> None:
    meaning = understand(text, parametric_modules())
    assert [errand.routed.formal_text for errand in meaning.errands] == asked_for
    assert any(": corrected to `" in note for note in meaning.account)


@pytest.mark.parametrize(
    "text",
    [
        "do not clean the table, no, fetch the can",
        "clean the table. No, wait, don't.",
        "fetch the can, no",
        "clean the left half, no, dance",
        "fetch the can to the right, no, fetch the block",
        "fetch the can, sorry for the fridge, the bottle",
        "make two dumplings, no, the red can",
        "no, the red can",
    ],
)
def test_a_correction_that_is_not_clear_is_refused(text: str) -> None:
    with pytest.raises(InstructionError):
        understand(text, parametric_modules())


def test_a_prohibition_after_a_comma_is_no_correction() -> None:
    meaning = understand("make two dumplings, no cleaning", parametric_modules())
    assert [errand.routed.formal_text for errand in meaning.errands] == [TWO]
    assert [str(one) for one in meaning.prohibited] == ["clean_table.clean_table"]
