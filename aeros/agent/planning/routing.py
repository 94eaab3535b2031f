"""A task together with the module that provides it."""

from __future__ import annotations

from dataclasses import dataclass

from aeros.spec.model.ecm import Task


@dataclass(frozen=True, slots=True)
class RoutedTask:
    """A task and the module that provides it.

    Attributes:
        module: id of the module.
        task: the task as the module declares it.
    """

    module: str
    task: Task

    def __str__(self) -> str:
        return f"{self.module}.{self.task.id}"
