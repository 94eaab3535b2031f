from __future__ import annotations

import pytest

from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.understand import understand
from tests.unit.agent.instructions.lists.reference import reference_modules

OF_THE_TABLE = ["clean_table.clean_table", "inspect_table.inspect_table", "serve_table.serve_table"]


@pytest.mark.parametrize(
    ("text", "never"),
    [
        (
            "make dumplings, but do not touch the table",
            OF_THE_TABLE,
        ),
        (
            "make dumplings and leave the table alone",
            OF_THE_TABLE,
        ),
        ("make dumplings, but keep away from the can", ["fetch_object.fetch_object(object = red_can)"]),
        ("fetch the can, the table must not be cleaned", ["clean_table.clean_table"]),
        (
            "fetch the can, but neither clean the table nor make dumplings",
            ["clean_table.clean_table", "make_dumplings.make_dumplings"],
        ),
    ],
)
def test_a_prohibition_names_every_task_that_it_may_mean(text: str, never: list[str]) -> None:
    meaning = understand(text, reference_modules())
    assert [one.formal_text for one in meaning.prohibited] == never


@pytest.mark.parametrize("text", ["make dumplings, but do not touch the sponge", "clean it, but not or"])
def test_a_prohibition_of_nothing_that_a_task_is_about_is_refused(text: str) -> None:
    with pytest.raises(InstructionError):
        understand(text, reference_modules())
