"""Routing of an instruction to the one task that it names, by the trigger phrases of the tasks.

Whole words match, in any case. The task's own name, alone or after its module's, selects that task.
If several tasks match, or none, an error says so: the agent does not guess. If an installed module that is
not active has the only such task, the error says that, too.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from aeros.agent.errors import AgentError
from aeros.spec.diagnostics.codes import quoted
from aeros.spec.diagnostics.words import normalized_words
from aeros.spec.model.ecm import Ecm, Task


class RoutingError(AgentError):
    """An instruction that names no task, or more than one."""


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


def route(
    instruction: str,
    modules: Mapping[str, Ecm],
    inactive: Callable[[], Mapping[str, Ecm]] = dict,
) -> RoutedTask:
    """Find the only task of the active modules that matches the instruction.

    Args:
        instruction: words of the user.
        modules: active modules by id.
        inactive: returns the other installed modules; called only if no task matches.

    Returns:
        The task.

    Raises:
        RoutingError: no task matches, or several.
    """
    tasks, asked = _tasks(modules), normalized_words(instruction)
    found = _matching_tasks(asked, tasks)
    if len(found) == 1:
        return found[0]
    if found:
        candidates = ", ".join(f"`{routed}` ({', '.join(routed.task.trigger_phrases)})" for routed in found)
        raise RoutingError(f"{quoted(instruction)} may mean several tasks: {candidates}")
    idle = _matching_tasks(asked, _tasks(inactive()))
    if idle:
        means = ", ".join(f"`{routed}` (`aeros activate {routed.module}`)" for routed in idle)
        raise RoutingError(f"no active module provides {quoted(instruction)}; installed is {means}")
    raise RoutingError(f"no installed module provides {quoted(instruction)}; {_suggestion(asked, tasks)}")


def _tasks(modules: Mapping[str, Ecm]) -> list[RoutedTask]:
    return [RoutedTask(name, task) for name, module in modules.items() for task in module.tasks.values()]


def _matching_tasks(instruction: tuple[str, ...], tasks: list[RoutedTask]) -> list[RoutedTask]:
    """Return the tasks whose name equals the instruction, else those with a trigger phrase in it."""
    named = [
        routed
        for routed in tasks
        if instruction in (normalized_words(routed.task.id), normalized_words(str(routed)))
    ]
    return named or [
        routed
        for routed in tasks
        if any(_contains_words(instruction, word) for word in routed.task.trigger_phrases)
    ]


def _contains_words(asked: tuple[str, ...], declared: str) -> bool:
    """Return True if the words of `declared` occur in `asked` next to each other."""
    wanted = normalized_words(declared)
    last = len(asked) - len(wanted)
    return bool(wanted) and any(asked[at : at + len(wanted)] == wanted for at in range(last + 1))


def _suggestion(asked: tuple[str, ...], tasks: list[RoutedTask]) -> str:
    declared = {word: routed for routed in tasks for word in routed.task.trigger_phrases}
    if not declared:
        return "no task is installed"
    # An instruction may be any text at all, and difflib is quadratic.
    close = [near for word in asked[:50] for near in difflib.get_close_matches(word[:64], declared, n=1)]
    shown = dict.fromkeys(close or sorted(declared))
    return "nearest: " + ", ".join(f"`{word}` ({declared[word]})" for word in list(shown)[:8])
