"""Tasks of other modules that a task composes: their scenes and typical starts serve it where it has none."""

from __future__ import annotations

from collections.abc import Iterator

from aeros.spec.expr import terms as t
from aeros.spec.model.ecm import Ecm, Task, owner_of


def composed_tasks(ecm: Ecm, task: Task) -> dict[str, Task]:
    """Find the tasks of required modules whose work a task asks for.

    Args:
        ecm: the module of the task, with the modules that it requires.
        task: the task.

    Returns:
        For each module that is required by name and whose skills the rules run or whose variables the goal
        reads, by its id in the order of the rules: the one of its tasks whose goal reads most of what the
        goal of this task reads. A module without tasks is left out.
    """
    goal = t.variables_of(task.goal).keys()
    found: dict[str, Task] = {}
    for module in dict.fromkeys((*_modules_run(ecm, task), *(name.partition(".")[0] for name in goal))):
        required = ecm.foreign.modules.get(module)
        if required is not None and required.tasks:
            found[module] = max(
                required.tasks.values(), key=lambda one: len(goal & t.variables_of(one.goal).keys())
            )
    return found


def _modules_run(ecm: Ecm, task: Task) -> Iterator[str]:
    for rule in task.rules:
        for name in (rule.skill, rule.between_tries, rule.on_failure):
            ways = () if name is None else ecm.alternatives(name)
            yield from (owner_of(skill, ecm.id)[0] for way in ways for skill in way.skills)
