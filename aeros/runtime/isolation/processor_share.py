"""Bound on a worker's processor time where there are no control groups: it is paused while it is ahead.

The zygote watches its worker. It looks at the kernel's account of the worker's processor time, stops the
process by a signal that it cannot block when it has used up its credit, and continues it once there is
credit again. On average the worker then gets its share. It may run ahead for as long as the zygote waits for
a processor itself, and pays that back.
"""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Final

from aeros.runtime.isolation.kernel import child_processes

_PERIOD_S: Final = 0.1
"""Time for which credit is collected at most, s; the period of control groups, too."""

_SHORTEST_LOOK_S: Final = 0.002
"""Least time between two looks at a worker that runs, s."""


class ProcessorCredit:
    """Credit of a process: grows by its share of the time, shrinks by its processor time.

    Args:
        share: processor time for each second, s; above 0.
        now: time, s.
        used: processor time of the process so far, s.
    """

    def __init__(self, share: float, now: float, used: float) -> None:
        self._share, self._now, self._used = share, now, used
        self._most = share * _PERIOD_S
        self._credit = self._most
        self.is_paused = False

    def update(self, now: float, used: float) -> float:
        """Account for the time since the previous call, and decide if the process is paused from now on.

        Args:
            now: time, s.
            used: processor time of the process so far, s.

        Returns:
            Time after which to call again, s.
        """
        earned, spent = self._share * (now - self._now), used - self._used
        self._credit = min(self._credit + earned - spent, self._most)
        self._now, self._used = now, used
        # A paused process goes on with half of the credit, so that it is not continued for an instant.
        enough = self._most / 2 if self.is_paused else 0.0
        self.is_paused = self._credit <= enough
        if self.is_paused:
            return (self._most / 2 - self._credit) / self._share + _SHORTEST_LOOK_S
        return max(self._credit, _SHORTEST_LOOK_S)


class WatchedWorker:
    """Worker that is paused while it is ahead of its share, and killed if it has started another process.

    Args:
        pid: its process, a child of this one.
        share: processor time for each second, s; above 0.
        clock: returns the time, s.
    """

    def __init__(self, pid: int, share: float, clock: Callable[[], float] = time.monotonic) -> None:
        self._pid, self._clock = pid, clock
        self._credit = ProcessorCredit(share, clock(), processor_time(pid))

    def watch(self) -> float:
        """Pause, continue or kill the worker as it deserves.

        Returns:
            Time after which to call again, s.
        """
        with suppress(OSError):  # it has ended
            if set(child_processes()) - {self._pid} or child_processes(self._pid):
                # Its processor time is not that of the worker.
                os.kill(self._pid, signal.SIGKILL)
            was_paused = self._credit.is_paused
            seconds = self._credit.update(self._clock(), processor_time(self._pid))
            if self._credit.is_paused != was_paused:
                os.kill(self._pid, signal.SIGCONT if was_paused else signal.SIGSTOP)
            return seconds
        return _PERIOD_S


def processor_time(pid: int) -> float:
    """Ask the kernel for the processor time that all threads of a process have used.

    Args:
        pid: the process.

    Returns:
        The time, s.

    Raises:
        OSError: there is no such process.
    """
    # The clock of another process, as the C library's `clock_getcpuclockid` makes it.
    return time.clock_gettime((~pid << 3) | 2)
