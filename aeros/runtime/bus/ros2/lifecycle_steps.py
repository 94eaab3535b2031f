"""Transitions by which a managed node follows the operator's command."""

from __future__ import annotations

from enum import Enum
from typing import Final

from aeros.runtime.execution.governor import OperatorCommand


class LifecycleStep(Enum):
    """A transition of a managed node."""

    CONFIGURE = "configure"
    ACTIVATE = "activate"
    DEACTIVATE = "deactivate"
    SHUTDOWN = "shutdown"


_STEPS: Final = {
    ("unconfigured", OperatorCommand.RUN): LifecycleStep.CONFIGURE,
    ("unconfigured", OperatorCommand.PAUSE): LifecycleStep.CONFIGURE,
    ("unconfigured", OperatorCommand.STOP): LifecycleStep.SHUTDOWN,
    ("inactive", OperatorCommand.RUN): LifecycleStep.ACTIVATE,
    ("inactive", OperatorCommand.STOP): LifecycleStep.SHUTDOWN,
    ("active", OperatorCommand.PAUSE): LifecycleStep.DEACTIVATE,
    ("active", OperatorCommand.STOP): LifecycleStep.SHUTDOWN,
}


def next_step(state: str, command: OperatorCommand) -> LifecycleStep | None:
    """Choose the next transition.

    Args:
        state: Label of the node's state, as `inactive`.
        command: The command in force.

    Returns:
        The transition; None if the state is that of the command, or the node is between states or finalized.
    """
    return _STEPS.get((state, command))
