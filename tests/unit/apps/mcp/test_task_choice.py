"""The task of a plan: the server's own, the only one, or one that the client names."""

from __future__ import annotations

import pytest

from aeros.agent.instructions.refusals import InstructionError
from aeros.apps.mcp.task_choice import TaskChoice, start_tasks
from tests.unit.apps.mcp.cells import dumplings, shipped


def test_a_server_with_an_instruction_has_its_task() -> None:
    modules = dumplings().modules
    choice = TaskChoice("make two dumplings", modules)
    assert str(choice.find(None, modules)) == "make_dumplings.make_dumplings"
    assert choice.find(None, modules).arguments == {"count": 2}
    (task,) = start_tasks(choice, modules)
    assert task.initial["make_dumplings.count"] == 2


def test_a_server_with_one_task_needs_no_instruction() -> None:
    modules = dumplings().modules
    assert TaskChoice(None, modules).find(None, modules).arguments == {"count": 1}


def test_a_server_with_several_tasks_asks_for_one() -> None:
    modules = shipped()
    choice = TaskChoice(None, modules)
    with pytest.raises(InstructionError, match=r"name it with `task`, as one of clean_table\.clean_table, "):
        choice.find(None, modules)
    assert str(choice.find("clean the table", modules)) == "clean_table.clean_table"
    named = choice.find("fetch_object.fetch_object object=blue_block", modules)
    assert named.arguments["object"] == "blue_block"
    assert len(start_tasks(choice, modules)) == sum(len(one.tasks) for one in modules.values())


@pytest.mark.parametrize("words", ["make pizza", "make dumplings, then clean the table"])
def test_an_instruction_for_none_or_several_tasks_is_refused(words: str) -> None:
    modules = shipped()
    with pytest.raises(InstructionError):
        TaskChoice(words, modules)


def test_without_any_task_there_is_nothing_to_start_with() -> None:
    with pytest.raises(InstructionError, match="no active module has a task"):
        start_tasks(TaskChoice(None, {}), {})
