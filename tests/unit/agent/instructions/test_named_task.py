"""A task may be named with values of its parameters, in place of words."""

from __future__ import annotations

import pytest

from aeros.agent.instructions.named_task import named_tasks
from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.planning.routing import RoutedTask
from tests.unit.agent.instructions.lists.reference import reference_modules


def tasks() -> list[RoutedTask]:
    return [RoutedTask(name, one) for name, ecm in reference_modules().items() for one in ecm.tasks.values()]


@pytest.mark.parametrize(
    ("instruction", "found"),
    [
        ("fetch_object", ["fetch_object.fetch_object(object = red_can, to = anywhere)"]),
        ("FETCH_OBJECT", ["fetch_object.fetch_object(object = red_can, to = anywhere)"]),
        (
            "fetch_object.fetch_object object=blue_block to=left",
            ["fetch_object.fetch_object(object = blue_block, to = left)"],
        ),
        ("fetch_object 'to=right'", ["fetch_object.fetch_object(object = red_can, to = right)"]),
        ("fetch_object to = right", []),
        ("fetch the can", []),
        ("", []),
        ("fetch_object 'open quote", []),
    ],
)
def test_a_name_with_assignments_is_a_task_with_arguments(instruction: str, found: list[str]) -> None:
    assert [one.formal_text for one in named_tasks(instruction, tasks())] == found


@pytest.mark.parametrize(
    ("instruction", "reason"),
    [
        ("fetch_object objct=red_can", r"has no parameter `objct`; did you mean `object`\?"),
        ("fetch_object colour=red", "has no parameter `colour`; its parameters: `object`, `to`"),
        ("make_dumplings object=red_can", "has no parameter `object`; its parameters: `count`"),
        ("make_dumplings count=3", "`3` is no value of `count` of .*: 1 to 2 .at most 2: the cell has two"),
        ("fetch_object object=red", "`red` is no value of `object` of .*: red_can, blue_block"),
        ("fetch_object to=left to=right", "`to` is given twice"),
    ],
)
def test_unknown_parameters_and_values_are_refused(instruction: str, reason: str) -> None:
    with pytest.raises(InstructionError, match=reason):
        named_tasks(instruction, tasks())
