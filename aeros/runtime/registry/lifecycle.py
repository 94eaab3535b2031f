"""Life cycle of a module on a robot, as a table: install, configure, activate, deactivate, remove.

Source: the paper, section 3.4 (ECM lifecycle), with its loop between activate and deactivate. An upgrade is
an install over an existing version, and keeps the module's state.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from typing import Final


class ModuleState(Enum):
    """State of a module in its life cycle."""

    ABSENT = "absent"
    INSTALLED = "installed"  # stored, and proved alone under the policy
    CONFIGURED = "configured"  # its dependencies are installed
    ACTIVE = "active"  # its skills can be run


class LifecycleAction(Enum):
    """Act of an operator on a module."""

    INSTALL = "install"
    CONFIGURE = "configure"
    ACTIVATE = "activate"
    DEACTIVATE = "deactivate"
    REMOVE = "remove"


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


def allowed_states(verb: LifecycleAction) -> tuple[ModuleState, ...]:
    """List the states in which an act is allowed, for messages.

    Args:
        verb: act of the operator.

    Returns:
        States in the order of the table.
    """
    return tuple(state for state, one in TRANSITIONS if one is verb)
