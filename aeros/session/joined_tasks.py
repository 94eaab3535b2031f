"""Tasks of one instruction as one simulator serves them: their scenes, and an initial state for all."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from aeros.agent.instructions.understand import Understanding
from aeros.runtime.gate.configuration import Configuration
from aeros.spec.expr import terms as t
from aeros.spec.model.ecm import Task


def tasks_of(understanding: Understanding, configuration: Configuration) -> list[Task]:
    """List the tasks whose scenes a simulator needs for an instruction.

    Args:
        understanding: The requests, in order.
        configuration: The active modules.

    Returns:
        The tasks of the requests, in order, each once; then, for each goal that reads variables of a module
        without such a task, as `--goal` may, the task of that module that has the most of them in its goal.
    """
    found: list[Task] = []
    for errand in understanding.errands:
        if all(errand.routed.task.span != one.span for one in found):
            found.append(errand.routed.task)
    return [*found, *_tasks_behind_goals(understanding, configuration)]


def joined_task(understanding: Understanding, configuration: Configuration) -> Task:
    """Return a task whose initial state serves all tasks of an instruction.

    Args:
        understanding: The requests, in order.
        configuration: The active modules.

    Returns:
        The first task, with the initial values of the others for variables that it does not name.
    """
    tasks = tasks_of(understanding, configuration)
    initial = {name: value for task in reversed(tasks) for name, value in task.initial.items()}
    return replace(tasks[0], initial=initial)


def _tasks_behind_goals(understanding: Understanding, configuration: Configuration) -> Iterator[Task]:
    served = {errand.routed.module for errand in understanding.errands}
    for errand in understanding.errands:
        names = t.variables_of(errand.routed.task.goal).keys()
        for module in dict.fromkeys(name.partition(".")[0] for name in names if "." in name):
            tasks = configuration.modules[module].tasks.values() if module in configuration.modules else ()
            if tasks and module not in served:
                served.add(module)
                yield max(tasks, key=lambda task: len(names & t.variables_of(task.goal).keys()))
