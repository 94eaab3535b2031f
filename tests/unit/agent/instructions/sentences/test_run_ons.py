"""Run-on requests are split only where each part is a whole request of one task."""

from __future__ import annotations

import pytest

from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.understand import understand
from tests.unit.agent.instructions.lists.reference import parametric_modules


def tasks_of(text: str) -> list[str]:
    return [one.routed.task.id for one in understand(text, parametric_modules()).errands]


@pytest.mark.parametrize(
    ("text", "tasks"),
    [
        ("bring the can wipe the table", ["fetch_object", "clean_table"]),
        (
            "wipe the table make two dumplings fetch the block",
            ["clean_table", "make_dumplings", "fetch_object"],
        ),
        ("get the table clean", ["clean_table"]),
    ],
)
def test_each_request_of_a_run_on_is_done_in_order(text: str, tasks: list[str]) -> None:
    assert tasks_of(text) == tasks


@pytest.mark.parametrize(
    "text",
    [
        "get the can to clean the table",
        "bring the can clean the window",
        "she wants the can clean the table",
        "bring the can or clean the table",
        "never bring the can clean the table",
    ],
)
def test_words_that_are_no_row_of_requests_are_refused(text: str) -> None:
    with pytest.raises(InstructionError):
        tasks_of(text)
