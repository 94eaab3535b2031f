from __future__ import annotations

import pytest

from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.understand import understand
from tests.unit.agent.instructions.lists.reference import parametric_modules


def test_the_opposite_of_a_condition_that_the_first_request_makes_true_is_refused() -> None:
    with pytest.raises(InstructionError, match="which makes it true"):
        understand("If the table is dirty, clean it; if it is clean, make a dumpling.", parametric_modules())


def test_the_opposite_is_understood_where_the_first_request_does_not_change_it() -> None:
    meaning = understand(
        "If the table is clean, make a dumpling; if it is dirty, clean it.", parametric_modules()
    )
    assert [(one.routed.task.id, one.condition_text) for one in meaning.errands] == [
        ("make_dumplings", "table_wiped"),
        ("clean_table", "not table_wiped"),
    ]


@pytest.mark.parametrize(
    ("instruction", "lines"),
    [
        (
            "if the table is clean, make a dumpling, otherwise clean it",
            [
                "make_dumplings.make_dumplings(count = 1): dumplings_cooked >= count (if table_wiped)",
                "clean_table.clean_table(region = whole): table_wiped and table_organized and table_verified "
                "(otherwise, if not (table_wiped))",
            ],
        ),
        (
            "unless the table is clean, wipe it. Otherwise make a dumpling. Then bring me the can.",
            [
                "clean_table.clean_table(region = whole): table_wiped and table_organized and table_verified "
                "(if not (table_wiped))",
                "make_dumplings.make_dumplings(count = 1): dumplings_cooked >= count "
                "(otherwise, if table_wiped)",
                "fetch_object.fetch_object(object = red_can, to = anywhere): object_delivered",
            ],
        ),
        (
            "if the table is clean, do nothing, otherwise wipe it",
            [
                "clean_table.clean_table(region = whole): table_wiped and table_organized and table_verified "
                "(if not (table_wiped))"
            ],
        ),
    ],
)
def test_one_measurement_decides_both_branches(instruction: str, lines: list[str]) -> None:
    assert list(understand(instruction, parametric_modules()).formal_lines) == lines


@pytest.mark.parametrize(
    ("instruction", "reason"),
    [
        ("clean the table. Otherwise bring the can.", "no single request with a condition before it"),
        ("if the table is dirty, clean it, otherwise if it is clean, bring the can", "a condition after"),
        ("if the table is dirty, clean it, otherwise bring the can, then make tea", "in either case"),
        ("if the table is dirty, clean it, otherwise don't make dumplings", "a prohibition with a condition"),
        ("if the table is dirty, clean it, else bring the can, else make dumplings", "a second `otherwise`"),
    ],
)
def test_other_branches_are_refused_in_words(instruction: str, reason: str) -> None:
    with pytest.raises(InstructionError, match=reason):
        understand(instruction, parametric_modules())
