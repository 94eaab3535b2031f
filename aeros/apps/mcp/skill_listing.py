"""Skills, tasks and measurements as MCP clients read them: JSON values."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

from aeros.agent.planning.routing import RoutedTask
from aeros.agent.world.values import effects_for_reading, to_json_value
from aeros.agent.world.world import WorldModel
from aeros.spec.expr.types import RealType, VectorType
from aeros.spec.model.ecm import Ecm, Task
from aeros.spec.model.variables import Declared

_MAX_PHRASES: Final = 8
"""Phrases of a task that clients get; a task may have a hundred."""


def list_tasks(modules: Mapping[str, Ecm]) -> list[dict[str, Any]]:
    """List the tasks of modules.

    Args:
        modules: Active modules by id.

    Returns:
        Each task with its goal, its words and its parameters.
    """
    return [
        task_to_json(f"{module.id}.{task.id}", task)
        for module in modules.values()
        for task in module.tasks.values()
    ]


def routed_to_json(routed: RoutedTask) -> dict[str, Any]:
    """Return the task that an instruction asked for.

    Args:
        routed: The task and its module.

    Returns:
        JSON values, as `list_tasks` returns for each task.
    """
    return task_to_json(str(routed), routed.task)


def task_to_json(name: str, task: Task) -> dict[str, Any]:
    """Return a task as clients read it.

    Args:
        name: Its name, `MODULE.TASK`.
        task: The task.

    Returns:
        JSON values.
    """
    parameters = {key: _declared(one.declared) for key, one in task.parameters.items()}
    words = list(task.trigger_phrases[:_MAX_PHRASES])
    return {"name": name, "goal": task.goal_text, "words": words, "parameters": parameters}


def list_skills(ecm: Ecm) -> Iterator[dict[str, Any]]:
    """List the skills of a module.

    Args:
        ecm: The module.

    Yields:
        Each skill with its risk, precondition, outcomes, and the inputs that have no default.
    """
    for skill in ecm.skills.values():
        yield {
            "skill": f"{ecm.id}.{skill.id}",
            "risk": skill.risk.name.lower(),
            "precondition": None if skill.precondition is None else skill.precondition.text,
            "outcomes": [
                {"outcome": one.id, "failure": one.failure, "then": effects_for_reading(one)}
                for one in skill.outcomes.values()
            ],
            "inputs": {
                name.removeprefix("inputs."): _declared(one)
                for name, one in skill.inputs.items()
                if one.default_value is None
            },
        }


def world_to_json(world: WorldModel) -> dict[str, dict[str, Any]]:
    """Return measurements with their ages, or why they are unknown.

    Args:
        world: The measured world.

    Returns:
        JSON values by the name of the state variable.
    """
    known = {
        name: {"value": to_json_value(value), "age": world.time - world.stamps[name].time}
        for name, value in world.known.items()
    }
    return {**known, **{name: {"value": None, "unknown": why} for name, why in world.unknown.items()}}


def _declared(one: Declared) -> dict[str, Any]:
    type_ = one.variable.type
    unit = str(type_.dimension) if isinstance(type_, RealType | VectorType) else None
    return {
        "type": str(type_),
        "unit": unit,
        "range": None if one.range is None else [*map(float, one.range)],
    }
