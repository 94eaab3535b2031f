"""Choice of the task that a client's plan is for."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from aeros.agent.instructions.meaning import single_errand
from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.understand import understand
from aeros.agent.planning.routing import RoutedTask
from aeros.spec.model.ecm import Ecm, Task


class TaskChoice:
    """Finds the task that the words of a client name.

    Args:
        instruction: Words of the operator that name the task of plans which name none; None for none.
        modules: Active modules by id, at the start.
        inactive: Returns the other installed modules, for a hint if the instruction is not understood.

    Attributes:
        default: The task of plans that name none; None if each plan has to name one.

    Raises:
        InstructionError: The instruction is not understood, or asks for more than one task.
    """

    def __init__(
        self,
        instruction: str | None,
        modules: Mapping[str, Ecm],
        inactive: Callable[[], Mapping[str, Ecm]] = dict,
    ) -> None:
        if instruction is None and len(names := _task_names(modules)) == 1:
            (instruction,) = names
        self.default: RoutedTask | None = None
        if instruction is not None:
            self.default = single_errand(understand(instruction, modules, inactive))

    def find(self, words: str | None, modules: Mapping[str, Ecm]) -> RoutedTask:
        """Find the task of a plan.

        Args:
            words: An instruction, or a task as `MODULE.TASK` with `PARAMETER=VALUE`; None for the default.
            modules: Modules that are active now, by id.

        Returns:
            The task with the values of its parameters.

        Raises:
            InstructionError: The words are not understood, ask for more than one task, or are missing while
                there is no default.
        """
        if words is not None:
            return single_errand(understand(words, modules))
        if self.default is None:
            raise InstructionError(f"name it with `task`, as one of {', '.join(_task_names(modules))}")
        return self.default


def _task_names(modules: Mapping[str, Ecm]) -> list[str]:
    return [f"{ecm.id}.{task}" for ecm in modules.values() for task in ecm.tasks]


def start_tasks(choice: TaskChoice, modules: Mapping[str, Ecm]) -> list[Task]:
    """List the tasks whose scenes and initial states a simulator has to serve.

    Args:
        choice: The tasks of a server.
        modules: Active modules by id.

    Returns:
        The default task alone, or else all tasks.

    Raises:
        InstructionError: No active module has a task.
    """
    if choice.default is not None:
        return [choice.default.task_at_start]
    tasks = [task for ecm in modules.values() for task in ecm.tasks.values()]
    if not tasks:
        raise InstructionError("no active module has a task")
    return tasks
