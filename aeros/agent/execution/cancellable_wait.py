"""Wait for steps that ends early once the client of the task has cancelled it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from aeros.runtime.ports import EndedStep, Runtime

_INTERVAL_S: Final = 0.1  # plant seconds between looks for a cancellation


class CancellableWait:
    """Wait of one run; a cancellation ends one wait, and later ones are not cut short.

    Args:
        runtime: The runtime.

    Attributes:
        is_cancelled: Returns True once the client has cancelled the task; None if nobody can.
        was_cancelled: True if a wait has ended for that.
    """

    def __init__(self, runtime: Runtime) -> None:
        self.is_cancelled: Callable[[], bool] | None = None
        self.was_cancelled = False
        self._runtime = runtime

    @property
    def now(self) -> float:
        """Plant time, s."""
        return self._runtime.now()

    def until(self, time: float) -> EndedStep | None:
        """Wait for the next step to end.

        Args:
            time: Plant time (s) at which the wait ends.

        Returns:
            The step that ended, or None if none did before `time`, or the task is cancelled meanwhile.
        """
        if self.is_cancelled is None or self.was_cancelled:
            return self._runtime.wait(time)
        while not self.is_cancelled():
            turn = min(time, self._runtime.now() + _INTERVAL_S)
            ended = self._runtime.wait(turn)
            if ended is not None or turn >= time:
                return ended
        self.was_cancelled = True
        return None
