"""An instruction that names a task, with values of its parameters: `wash_pot pot=small`."""

from __future__ import annotations

import re
import shlex
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final

from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.planning.routing import RoutedTask
from aeros.spec.diagnostics.codes import did_you_mean, quoted
from aeros.spec.diagnostics.words import normalized_words
from aeros.spec.elaborate.values import value_of_argument
from aeros.spec.expr.types import EnumType
from aeros.spec.expr.units import format_quantity
from aeros.spec.model.task_parameters import TaskParameter

_ASSIGNMENT: Final = re.compile(r"([A-Za-z_]\w*)\s*=\s*(.+)", re.DOTALL)


def named_tasks(instruction: str, tasks: Sequence[RoutedTask]) -> list[RoutedTask]:
    """Find the tasks that an instruction names.

    Args:
        instruction: the name of a task (`MODULE.TASK` or `TASK`), and values of its parameters.
        tasks: the tasks.

    Returns:
        The tasks of that name, with their arguments; empty if the instruction is none of this form.

    Raises:
        InstructionError: a parameter or value is unknown, or one is missing.
    """
    try:
        name, *assignments = shlex.split(instruction) or [""]
    except ValueError:
        return []
    found = _ASSIGNMENT.fullmatch
    words = normalized_words(instruction if not all(map(found, assignments)) else name)
    named = [
        routed
        for routed in tasks
        if words in (normalized_words(routed.task.id), normalized_words(str(routed)))
    ]
    given = [match.groups() for one in assignments if (match := found(one))]
    return [replace(routed, arguments=_arguments(routed, given)) for routed in named]


def _arguments(routed: RoutedTask, given: Sequence[tuple[str, ...]]) -> dict[str, Any]:
    values: dict[str, Any] = {}
    known = routed.task.parameters
    for name, text in given:
        if name not in known:
            near = did_you_mean(name, known)
            listed = ", ".join(f"`{one}`" for one in known) or "none"
            help_ = f"did you mean `{near}`?" if near else f"its parameters: {listed}"
            raise InstructionError(f"`{routed}` has no parameter {quoted(name)}; {help_}")
        if name in values:
            raise InstructionError(f"`{name}` is given twice")
        values[name] = _value(routed, known[name], text)
    arguments = routed.task.complete_arguments(values)
    missing = [name for name in known if name not in arguments]
    if missing:
        listed = ", ".join(f"`{name}` ({_choices(known[name])})" for name in missing)
        raise InstructionError(
            f"`{routed}` needs a value of {listed}, as in `{routed.task.id} {missing[0]}=…`"
        )
    return arguments


def _value(routed: RoutedTask, parameter: TaskParameter, text: str) -> Any:
    value = value_of_argument(text, parameter.declared)
    if value is None:
        raise InstructionError(
            f"{quoted(text)} is no value of `{parameter.name}` of `{routed}`: {_choices(parameter)}"
        )
    return value


def _choices(parameter: TaskParameter) -> str:
    if isinstance(parameter.declared.variable.type, EnumType):
        return ", ".join(parameter.values)
    if parameter.declared.range is None:
        return "true, false"
    low, high = (format_quantity(one, parameter.declared.unit) for one in parameter.declared.range)
    return f"{low} to {high}{parameter.note}"
