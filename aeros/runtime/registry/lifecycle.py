"""The life of a module on a robot, as a table: install, configure, activate, deactivate, remove.

Source: the paper, section 3.4 (ECM lifecycle), with its loop between activate and deactivate.  An
upgrade is an install over what is there, and leaves the module in the state it was in.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from typing import Final


class ModuleState(Enum):
    """Where in its life a module is."""

    ABSENT = "absent"
    INSTALLED = "installed"  # kept, and proved by itself under the policy
    CONFIGURED = "configured"  # its dependencies are met by what is installed
    ACTIVE = "active"  # its skills can be dispatched


class LifecycleAction(Enum):
    """What an operator can do to a module."""

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
"""Every step there is; anything else is refused."""


def next_state(state: ModuleState, verb: LifecycleAction) -> ModuleState | None:
    """The state that `verb` leads to from `state`, or None where it may not be done."""
    return TRANSITIONS.get((state, verb))


def allowed_states(verb: LifecycleAction) -> tuple[ModuleState, ...]:
    """The states from which `verb` may be done, for whoever is refused."""
    return tuple(state for state, one in TRANSITIONS if one is verb)
