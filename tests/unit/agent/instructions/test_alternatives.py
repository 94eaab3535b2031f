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
