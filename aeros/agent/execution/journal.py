"""Journal of the agent's events: to the audit record, to an observer and to memory."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from aeros.agent.memory.store import Memory
from aeros.runtime.ports import Runtime


@dataclass(frozen=True, slots=True)
class AgentEvent:
    """Something that the agent did or found.

    Attributes:
        kind: kind as in the audit record, for example `plan-accepted`, `step-ended`, `replan`.
        text: one line for people; empty if there is nothing to show.
        details: JSON values.
        time: plant time (s).
    """

    kind: str
    text: str
    details: Mapping[str, Any]
    time: float


Observer = Callable[[AgentEvent], None]


class Journal:
    """Writer of each event to the audit record first, then to the observer, then to memory.

    A failure to write either record is raised: an agent that cannot record its actions stops.
    """

    def __init__(self, runtime: Runtime, memory: Memory, on_event: Observer | None) -> None:
        self._runtime = runtime
        self._memory = memory
        self._on_event = on_event

    def record(self, kind: str, text: str, **details: Any) -> None:
        """Record an event, also in memory's table of events.

        Args:
            kind: kind of the event.
            text: one line for people; may be empty.
            details: JSON values.
        """
        self.record_step(kind, text, **details)
        self._memory.add_event(self._runtime.now(), kind, details)

    def record_step(self, kind: str, text: str, **details: Any) -> None:
        """Record an event that memory keeps as part of an episode, so not as an event of its own.

        Args:
            kind: kind of the event.
            text: one line for people; may be empty.
            details: JSON values.
        """
        self._runtime.note(kind, details)
        if self._on_event is not None:
            self._on_event(AgentEvent(kind, text, details, self._runtime.now()))
