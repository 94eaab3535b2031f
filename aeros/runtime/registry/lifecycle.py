"""Life cycle of a module on a robot, as a table: install, configure, activate, deactivate, remove.

Source: the paper, section 3.4 (ECM lifecycle), with its loop between activate and deactivate. An upgrade is
an install over an existing version, and keeps the module's state. `reset` returns a module to `installed`.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from typing import Final


class ModuleState(Enum):
    """State of a module in its life cycle."""

    ABSENT = "absent"
    INSTALLED = "installed"  # stored; proved, unless it waits to be configured
    CONFIGURED = "configured"  # proved as it is bound, and its dependencies are installed
    ACTIVE = "active"  # its skills can be run


class LifecycleAction(Enum):
    """Act of an operator on a module."""

    INSTALL = "install"
    CONFIGURE = "configure"
    ACTIVATE = "activate"
    DEACTIVATE = "deactivate"
    REMOVE = "remove"
    RESET = "reset"  # `configure --reset`, or a new policy, where a need is open afterwards


TRANSITIONS: Final[Mapping[tuple[ModuleState, LifecycleAction], ModuleState]] = {
    (ModuleState.ABSENT, LifecycleAction.INSTALL): ModuleState.INSTALLED,
    (ModuleState.INSTALLED, LifecycleAction.INSTALL): ModuleState.INSTALLED,
    (ModuleState.CONFIGURED, LifecycleAction.INSTALL): ModuleState.CONFIGURED,
    (ModuleState.ACTIVE, LifecycleAction.INSTALL): ModuleState.ACTIVE,
    (ModuleState.INSTALLED, LifecycleAction.CONFIGURE): ModuleState.CONFIGURED,
    (ModuleState.CONFIGURED, LifecycleAction.CONFIGURE): ModuleState.CONFIGURED,
    (ModuleState.CONFIGURED, LifecycleAction.ACTIVATE): ModuleState.ACTIVE,
    (ModuleState.ACTIVE, LifecycleAction.DEACTIVATE): ModuleState.CONFIGURED,
    (ModuleState.INSTALLED, LifecycleAction.REMOVE): ModuleState.ABSENT,
    (ModuleState.CONFIGURED, LifecycleAction.REMOVE): ModuleState.ABSENT,
    (ModuleState.INSTALLED, LifecycleAction.RESET): ModuleState.INSTALLED,
    (ModuleState.CONFIGURED, LifecycleAction.RESET): ModuleState.INSTALLED,
}
"""All allowed transitions; any other is refused."""


def next_state(state: ModuleState, verb: LifecycleAction) -> ModuleState | None:
    """Look up a transition.

    Args:
        state: current state of the module.
        verb: act of the operator.

    Returns:
        The next state; None if the act is not allowed in `state`.
    """
    return TRANSITIONS.get((state, verb))


def preceding_action(state: ModuleState, verb: LifecycleAction) -> LifecycleAction | None:
    """Find the act after which another one is allowed, for messages.

    Args:
        state: current state of the module.
        verb: act of the operator that is not allowed in `state`.

    Returns:
        The act; None if no single act helps, or if both together would change nothing.
    """
    for one in LifecycleAction:
        reached = next_state(state, one)
        after = None if reached is None else next_state(reached, verb)
        if after is not None and after is not state:
            return one
    return None


def allowed_states(verb: LifecycleAction) -> tuple[ModuleState, ...]:
    """List the states in which an act is allowed, for messages.

    Args:
        verb: act of the operator.

    Returns:
        States in the order of the table.
    """
    return tuple(state for state, one in TRANSITIONS if one is verb)
