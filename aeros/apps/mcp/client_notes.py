"""Audit notes about clients, limited in rate, so that no client can fill the disk with them."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from typing import Any, Final

BURST: Final = 100
"""Notes that may be written at once."""

NOTES_PER_SECOND: Final = 1.0
"""Notes that may be written in the long run, 1/s of real time."""


class ClientNotes:
    """Writer of notes that clients cause at will, such as rejected calls and proposals.

    A token bucket of `BURST` notes is refilled by `NOTES_PER_SECOND`.  The next note after others were
    dropped holds their number.  Notes of what moves or stops the robot are not limited.

    Args:
        write: Appends an event to the audit log; any thread may call it.
        clock: Returns real time (s).
    """

    def __init__(
        self, write: Callable[[str, Mapping[str, Any]], None], clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._write = write
        self._clock = clock
        self._tokens = float(BURST)
        self._refilled = clock()
        self._dropped = 0
        self._lock = threading.Lock()

    def add(self, event: str, details: Mapping[str, Any]) -> bool:
        """Write a note, unless too many were written.

        Args:
            event: Kind of the event.
            details: JSON values.

        Returns:
            True if the note was written, False if it was dropped and counted.
        """
        with self._lock:
            now = self._clock()
            self._tokens = min(float(BURST), self._tokens + (now - self._refilled) * NOTES_PER_SECOND)
            self._refilled = now
            if self._tokens < 1.0:
                self._dropped += 1
                return False
            self._tokens -= 1.0
            dropped, self._dropped = self._dropped, 0
        self._write(event, {**details, "dropped_before": dropped} if dropped else details)
        return True

    def write_always(self, event: str, details: Mapping[str, Any]) -> None:
        """Write a note of something that moves or stops the robot.

        Args:
            event: Kind of the event.
            details: JSON values.
        """
        self._write(event, details)
