from __future__ import annotations

import pytest

from aeros.agent.instructions.meaning import single_errand, with_goal
from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.understand import understand
from aeros.spec.model.ecm import ActionCondition
from tests.unit.agent.dumplings import CLEAN, DUMPLING, SPAN, term

MODULES = {"dumpling": DUMPLING, "clean": CLEAN}


def test_only_a_single_request_is_a_single_errand_and_takes_another_goal() -> None:
    goal = ActionCondition(term("wrapper_aligned"), "wrapper_aligned", SPAN)
    one, two = (understand(text, MODULES) for text in ("clean", "clean, then dumpling"))
    assert str(single_errand(one)) == "clean.clean_table"
    assert with_goal(one, goal).first.task.goal_text == "wrapper_aligned"
    with pytest.raises(InstructionError, match="asks for more than one task"):
        single_errand(two)
    with pytest.raises(InstructionError, match="asks for several"):
        with_goal(two, goal)
