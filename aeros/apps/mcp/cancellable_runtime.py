"""Runtime of an agent whose plan another thread can cancel, which brings every motion to rest.

The executor runs in one thread and returns from `wait` when a step ends.  This wrapper waits in short turns
instead, so that a cancellation takes effect within `_TURN_S` of plant time.  The executor halts a cancelled
step as it halts any other: the motion is braked, the step's resources are released, the end is recorded.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import inf
from typing import Any, Final, Protocol

from aeros.runtime.ports import (
    AuditEvent,
    EndedStep,
    LogHead,
    Obstacle,
    Readings,
    Runtime,
    StepHandle,
    StepRequest,
    StepResult,
    StepStatus,
)
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.site import Site
from aeros.spec.verification.certificate import Certificate

_TURN_S: Final = 0.05
"""Plant time between two checks for a cancellation while steps run, s."""

_IDLE_TURN_S: Final = 1.0
"""Plant time between two checks for a cancellation while no step runs, s."""


class TurnRuntime(Runtime, Protocol):
    """Runtime that returns to its caller between actions; `Executor` is one."""

    def advance_once(self, until: float) -> EndedStep | None:
        """Let one skill act, or advance time.

        Args:
            until: Latest time to advance to, plant seconds.

        Returns:
            A step that has ended; None if none has.
        """


class CancellableRuntime:
    """A `Runtime` that wraps another, and ends all steps once `cancel_reason` returns a text.

    Args:
        runtime: Executes the steps.
        cancel_reason: Returns the reason of a cancellation, or None; called often, must be quick.
    """

    def __init__(self, runtime: TurnRuntime, cancel_reason: Callable[[], str | None]) -> None:
        self._runtime = runtime
        self._cancel_reason = cancel_reason
        self._active: set[StepHandle] = set()

    @property
    def site(self) -> Site:
        """Implement `Runtime.site`."""
        return self._runtime.site

    @property
    def is_stopped(self) -> bool:
        """Implement `Runtime.is_stopped`: nothing begins after a cancellation either."""
        return self._cancel_reason() is not None or self._runtime.is_stopped

    def active_modules(self) -> Mapping[str, Ecm]:
        """Implement `Runtime.active_modules`."""
        return self._runtime.active_modules()

    def certificate(self, module: str) -> Certificate | None:
        """Implement `Runtime.certificate`."""
        return self._runtime.certificate(module)

    def now(self) -> float:
        """Implement `Runtime.now`."""
        return self._runtime.now()

    def attend(self, modules: frozenset[str] | None) -> None:
        """Implement `Runtime.attend`."""
        self._runtime.attend(modules)

    def set_parameters(self, values: Mapping[str, Any]) -> None:
        """Implement `Runtime.set_parameters`."""
        self._runtime.set_parameters(values)

    def set_memories(self, memories: Mapping[str, Mapping[str, Any]]) -> None:
        """Implement `Runtime.set_memories`."""
        self._runtime.set_memories(memories)

    def observe(self) -> Readings:
        """Implement `Runtime.observe`."""
        return self._runtime.observe()

    def obstacles(self) -> Sequence[Obstacle]:
        """Implement `Runtime.obstacles`."""
        return self._runtime.obstacles()

    def start(self, request: StepRequest) -> StepHandle | StepResult:
        """Implement `Runtime.start`; after a cancellation no step begins."""
        reason = self._cancel_reason()
        if reason is not None:
            return StepResult(StepStatus.CANCELLED, reason)
        started = self._runtime.start(request)
        if not isinstance(started, StepResult):
            self._active.add(started)
        return started

    def wait(self, until: float = inf) -> EndedStep | None:
        """Implement `Runtime.wait`, in turns."""
        if not self._active:
            self._idle(until)
            return None
        while True:
            reason = self._cancel_reason()
            if reason is not None:
                for step in sorted(self._active):
                    self._runtime.cancel(step, reason)
            ended = self._runtime.advance_once(min(until, self._runtime.now() + _TURN_S))
            if ended is not None:
                self._active.discard(ended.step)
                return ended
            if self._runtime.now() >= until:
                return None

    def _idle(self, until: float) -> None:
        """Let plant time pass without steps, until `until` or a cancellation."""
        if until == inf:
            self._runtime.wait(until)  # raises: no step can end
        while self._cancel_reason() is None and self._runtime.now() < until:
            self._runtime.wait(min(until, self._runtime.now() + _IDLE_TURN_S))

    def cancel(self, step: StepHandle, reason: str) -> None:
        """Implement `Runtime.cancel`."""
        self._runtime.cancel(step, reason)

    def note(self, event: str, details: Mapping[str, Any]) -> None:
        """Implement `Runtime.note`."""
        self._runtime.note(event, details)

    def log_head(self) -> LogHead:
        """Implement `Runtime.log_head`."""
        return self._runtime.log_head()

    def events_since(self, head: LogHead) -> Sequence[AuditEvent] | None:
        """Implement `Runtime.events_since`."""
        return self._runtime.events_since(head)
