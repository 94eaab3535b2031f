"""The plant's end of the process that drives the hand."""

from __future__ import annotations

import time
from typing import Any, Final

from aeros.franka.link import LinkClosedError, event
from aeros.franka.process import Process
from aeros.runtime.ports import Reading

_INTERVAL: Final = 0.05
"""Time between two requests for the hand's state while something moves, s."""

_WAIT: Final = 0.3
"""Longest wait for the hand's state while nothing moves, s."""

_GRASP_ROOM: Final = 0.001
"""Least width of what is grasped over the commanded gap, m: fingers that close on nothing report a grasp,
too."""


class HandClient:
    """The hand, as the plant drives it.

    Args:
        address: of the robot.
        finger_speed: of one finger, m/s.

    Raises:
        ProcessError: the hand cannot be reached.

    Attributes:
        is_busy: a command is under way.
        failure: why the last command failed, or why the hand is gone; None if it did not and is not.
    """

    def __init__(self, address: str, finger_speed: float) -> None:
        self._process = Process("hand", {"address": address})
        self._speed = 2.0 * finger_speed
        self.is_busy = False
        self.failure: str | None = None
        self._is_gone = False
        self._commanded_gap = 0.0
        self._gap = 0.0
        self._is_grasped = False
        self._read_at: float | None = None
        self._asked_at = 0.0

    def grip(self, gap: float, force: float) -> None:
        """Move the fingers; `is_busy` until they rest.

        Args:
            gap: distance between the finger pads, m.
            force: on what is between them, N.
        """
        self.is_busy, self._commanded_gap, self.failure = True, gap, None
        self._send(event("grip", gap=gap, speed=self._speed, force=force))

    def refresh(self) -> None:
        """Wait for the hand's state, unless it is busy."""
        self.poll()
        if self.is_busy or self.failure is not None:
            return
        latest = time.monotonic() + _WAIT
        before = self._read_at
        self._send(event("read"))
        while self._read_at == before and self.failure is None and time.monotonic() < latest:
            self._receive(_WAIT)

    def poll(self) -> None:
        """Take in what the hand has said, and ask for its state from time to time."""
        while self._receive(0.0):
            pass
        now = time.monotonic()
        if not self.is_busy and now - self._asked_at > _INTERVAL:
            self._asked_at = now
            self._send(event("read"))

    def readings(self, now: float) -> dict[str, Reading]:
        """Return what the hand measures.

        Args:
            now: plant time, s.

        Returns:
            Readings by vocabulary name, each with its own time; empty if nothing was measured, or the hand is
            gone.
        """
        if self._read_at is None or self._is_gone:
            return {}
        at = now - (time.monotonic() - self._read_at)
        # Fingers that close on nothing report a grasp as wide as was commanded.
        holding = self._is_grasped and self._gap > self._commanded_gap + _GRASP_ROOM
        return {"finger_gap": Reading(self._gap, at), "holding": Reading(holding, at)}

    def close(self) -> None:
        """End the process; the fingers keep their grip. Safe to call twice."""
        self._process.close()

    def _send(self, message: dict[str, Any]) -> None:
        try:
            self._process.link.send(message)
        except LinkClosedError as failure:
            self._note_gone(str(failure))

    def _receive(self, timeout: float) -> bool:
        """Take in one message; return False if there is none."""
        try:
            message = self._process.link.receive(timeout)
        except LinkClosedError as failure:
            self._note_gone(str(failure))
            return False
        if not isinstance(message, dict):
            return False
        if message["is"] == "gone":
            self._note_gone(str(message["reason"]))
            return False
        self._gap, self._is_grasped = float(message["gap"]), bool(message["grasped"])
        self._read_at = float(message["at"])
        if message["is"] == "gripped":
            self.is_busy, self.failure = False, message["reason"]
        return True

    def _note_gone(self, why: str) -> None:
        self._is_gone, self.is_busy, self.failure = True, False, f"the hand is gone: {why}"
