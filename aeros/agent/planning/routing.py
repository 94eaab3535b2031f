"""A task together with the module that provides it, and with the values that an instruction says."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from aeros.spec.expr.units import format_quantity
from aeros.spec.model.ecm import Task


@dataclass(frozen=True, slots=True)
class RoutedTask:
    """A task and the module that provides it.

    Attributes:
        module: id of the module.
        task: the task as the module declares it.
        arguments: values (SI) of its parameters, by name; of a prohibition only those that it says.
    """

    module: str
    task: Task
    arguments: Mapping[str, Any] = field(default_factory=dict)

    def __str__(self) -> str:
        return f"{self.module}.{self.task.id}"

    @property
    def formal_text(self) -> str:
        """The task with its arguments, as in `fetch_object.fetch_object(object = red_can)`."""
        if not self.arguments:
            return str(self)
        given = ", ".join(f"{name} = {self._shown(name, one)}" for name, one in self.arguments.items())
        return f"{self}({given})"

    @property
    def instruction(self) -> str:
        """An instruction that asks for exactly this, as in `fetch_object.fetch_object object=red_can`."""
        given = (f" {name}={self._shown(name, one).replace(' ', '')}" for name, one in self.arguments.items())
        return f"{self}{''.join(given)}"

    @property
    def variables(self) -> dict[str, Any]:
        """Values (SI) of its parameters by the full names of their variables."""
        return {self.task.parameters[name].full_name: one for name, one in self.arguments.items()}

    @property
    def task_at_start(self) -> Task:
        """The task, whose initial state has these arguments."""
        return replace(self.task, initial={**self.task.initial, **self.variables})

    def covers(self, other: RoutedTask) -> bool:
        """Check if another task is this one, with every argument that this one has.

        Args:
            other: the other task.

        Returns:
            True if it is.
        """
        is_same = (self.module, self.task.id) == (other.module, other.task.id)
        return is_same and all(other.arguments.get(name) == one for name, one in self.arguments.items())

    def _shown(self, name: str, value: Any) -> str:
        if isinstance(value, bool):
            return "true" if value else "false"
        return (
            value
            if isinstance(value, str)
            else format_quantity(value, self.task.parameters[name].declared.unit)
        )
