"""Lifecycle of the agent as a table: created, running, paused, stopped, recovered.

The phase is kept in the agent's folder. Each change is in the audit record before it is kept. So a holder of
the lock that finds the phase `running` or `paused` knows that the previous agent crashed.
A change that is not in the table is a fault of AEROS, and raised.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from enum import Enum
from pathlib import Path
from types import MappingProxyType
from typing import Final

from aeros.agent.errors import AgentError
from aeros.files import replace_durably
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.migrations.format import FormatVersionError
from aeros.spec.migrations.formats import PHASE


class Phase(Enum):
    """Phase of the agent's lifecycle."""

    CREATED = "created"  # it has an identity, and was never given a task
    RUNNING = "running"  # it pursues a task
    PAUSED = "paused"  # the operator lets nothing begin
    STOPPED = "stopped"  # its task has ended, however that was
    RECOVERED = "recovered"  # it woke, and its last session had ended without a word


class LifecycleEvent(Enum):
    """Event that changes the phase."""

    BEGIN = "begin"  # it is given a task, or goes on with one
    PAUSE = "pause"
    RESUME = "resume"
    END = "end"
    CRASH = "crash"  # found by the next session


TRANSITIONS: Final[Mapping[tuple[Phase, LifecycleEvent], Phase]] = MappingProxyType(
    {
        (Phase.CREATED, LifecycleEvent.BEGIN): Phase.RUNNING,
        (Phase.STOPPED, LifecycleEvent.BEGIN): Phase.RUNNING,
        (Phase.RECOVERED, LifecycleEvent.BEGIN): Phase.RUNNING,
        (Phase.RUNNING, LifecycleEvent.PAUSE): Phase.PAUSED,
        (Phase.PAUSED, LifecycleEvent.RESUME): Phase.RUNNING,
        (Phase.RUNNING, LifecycleEvent.END): Phase.STOPPED,
        (Phase.PAUSED, LifecycleEvent.END): Phase.STOPPED,
        (Phase.RECOVERED, LifecycleEvent.END): Phase.STOPPED,
        (Phase.RUNNING, LifecycleEvent.CRASH): Phase.RECOVERED,
        (Phase.PAUSED, LifecycleEvent.CRASH): Phase.RECOVERED,
        (Phase.RECOVERED, LifecycleEvent.CRASH): Phase.RECOVERED,
    }
)
"""Every transition there is."""

_FILE: Final = "phase.json"

TransitionListener = Callable[[Phase, LifecycleEvent, Phase], None]
"""Puts a transition into the audit record."""


class Lifecycle:
    """Lifecycle of the agent of a folder. Its user must hold the folder's lock.

    With `folder=None` the phase is not kept.
    """

    def __init__(self, folder: Path | None, on_transition: TransitionListener) -> None:
        self._path = None if folder is None else folder / _FILE
        self._on_transition = on_transition
        self.phase = self._read_phase()
        if self.is_allowed(LifecycleEvent.CRASH):
            self.apply(LifecycleEvent.CRASH)

    def is_allowed(self, change: LifecycleEvent) -> bool:
        """Look an event up in the table of the current phase.

        Args:
            change: the event.

        Returns:
            True if the table has it.
        """
        return (self.phase, change) in TRANSITIONS

    def apply(self, change: LifecycleEvent) -> None:
        """Record the transition, then keep the new phase.

        Args:
            change: the event.

        Raises:
            InternalError: the table does not have this event in the current phase.
            AgentError: the file cannot be written.
        """
        if not self.is_allowed(change):
            raise InternalError(f"an agent that is {self.phase.value} does not allow `{change.value}`")
        then = TRANSITIONS[self.phase, change]
        self._on_transition(self.phase, change, then)
        self.phase = then
        if self._path is None:
            return
        try:
            replace_durably(self._path, json.dumps({"schema": PHASE.schema, "phase": then.value}).encode())
        except OSError as error:
            raise AgentError(f"{self._path} cannot be written: {error.strerror}") from error

    def _read_phase(self) -> Phase:
        if self._path is None:
            return Phase.CREATED
        try:
            kept = json.loads(self._path.read_text("utf-8"))
            PHASE.require_current(kept, self._path)
            return Phase(kept["phase"])
        except FileNotFoundError:
            return Phase.CREATED
        except FormatVersionError as error:
            raise AgentError(str(error)) from error
        except (OSError, ValueError, KeyError, TypeError):
            # In every other phase the process was killed.
            return Phase.RUNNING
