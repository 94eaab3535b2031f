"""Where everything the agent does is told: the audit record, memory, and whoever is watching."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from aeros.agent.memory.store import Memory
from aeros.runtime.ports import Runtime


@dataclass(frozen=True, slots=True)
class AgentEvent:
    """Something the agent did or found.

    kind: as in the audit record, for example `plan`, `step-ended`, `re-plan`.
    text: one line for people; empty where there is nothing to say to them.
    details: JSON values.
    time: plant seconds.
    """

    kind: str
    text: str
    details: Mapping[str, Any]
    time: float


Observer = Callable[[AgentEvent], None]


class Journal:
    """Tells each event to the audit record first, then to memory, then to the observer.

    A failure to write either record is raised: an agent that cannot say what it does stops.
    """

    def __init__(self, runtime: Runtime, memory: Memory, on_event: Observer | None) -> None:
        self._runtime = runtime
        self._memory = memory
        self._on_event = on_event

    def record(self, kind: str, text: str, **details: Any) -> None:
        """Record an event that memory has no other place for; `details` are JSON values."""
        self.record_step(kind, text, **details)
        self._memory.add_event(self._runtime.now(), kind, details)

    def record_step(self, kind: str, text: str, **details: Any) -> None:
        """Record an event that memory keeps as part of an episode."""
        self._runtime.note(kind, details)
        if self._on_event is not None:
            self._on_event(AgentEvent(kind, text, details, self._runtime.now()))
