"""The life of a module on a robot, as a table: install, configure, activate, deactivate, remove.

Source: the paper, section 3.4 (ECM lifecycle), with its loop between activate and deactivate.  An
upgrade is an install over what is there, and leaves the module in the state it was in.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from typing import Final


class State(Enum):
    """Where in its life a module is."""

    ABSENT = "absent"
    INSTALLED = "installed"  # kept, and proved by itself under the policy
    CONFIGURED = "configured"  # its dependencies are met by what is installed
    ACTIVE = "active"  # its skills can be dispatched


class Verb(Enum):
    """What an operator can do to a module."""

    INSTALL = "install"
    CONFIGURE = "configure"
    ACTIVATE = "activate"
    DEACTIVATE = "deactivate"
    REMOVE = "remove"


TRANSITIONS: Final[Mapping[tuple[State, Verb], State]] = {
    (State.ABSENT, Verb.INSTALL): State.INSTALLED,
    (State.INSTALLED, Verb.INSTALL): State.INSTALLED,
    (State.CONFIGURED, Verb.INSTALL): State.CONFIGURED,
    (State.ACTIVE, Verb.INSTALL): State.ACTIVE,
    (State.INSTALLED, Verb.CONFIGURE): State.CONFIGURED,
    (State.CONFIGURED, Verb.CONFIGURE): State.CONFIGURED,
    (State.CONFIGURED, Verb.ACTIVATE): State.ACTIVE,
    (State.ACTIVE, Verb.DEACTIVATE): State.CONFIGURED,
    (State.INSTALLED, Verb.REMOVE): State.ABSENT,
    (State.CONFIGURED, Verb.REMOVE): State.ABSENT,
}
"""Every step there is; anything else is refused."""


def after(state: State, verb: Verb) -> State | None:
    """The state that `verb` leads to from `state`, or None where it may not be done."""
    return TRANSITIONS.get((state, verb))


def before(verb: Verb) -> tuple[State, ...]:
    """The states from which `verb` may be done, for whoever is refused."""
    return tuple(state for state, one in TRANSITIONS if one is verb)
