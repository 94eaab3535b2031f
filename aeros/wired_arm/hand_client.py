"""The plant's end of the process that drives the hand."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any, Final

from aeros.runtime.ports import Reading
from aeros.wired_arm.link import LinkClosedError, event
from aeros.wired_arm.process import Process

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
        module: program of the process.

    Raises:
        ProcessError: the hand cannot be reached.

    Attributes:
        is_busy: a command is under way.
        failure: why the last command failed, or why the hand is gone; None if it did not and is not.
    """

    def __init__(self, address: str, finger_speed: float, module: str) -> None:
        self._process = Process("hand", {"address": address}, module)
        self._speed = 2.0 * finger_speed
        self.is_busy = False
        self.failure: str | None = None
        self._commanded_gap = 0.0
        self._readings: Mapping[str, Reading] = {}
        self._asked_at = 0.0

    def grip(self, gap: float, force: float) -> None:
        """Move the fingers; `is_busy` until they rest.

        Args:
            gap: distance between the finger pads, m.
            force: on what is between them, N.
        """
        self.is_busy, self._commanded_gap, self.failure = True, gap, None
        self._send(event("grip", gap=gap, speed=self._speed, force=force))

    def refresh(self, now: float) -> None:
        """Wait for the hand's state, unless it is busy.

        Args:
            now: plant time, s.
        """
        self.poll(now)
        if self.is_busy or self.failure is not None:
            return
        latest, before = time.monotonic() + _WAIT, self._readings
        self._send(event("read"))
        while self._readings is before and self.failure is None and time.monotonic() < latest:
            self._receive(_WAIT, now)

    def poll(self, now: float) -> None:
        """Take in what the hand has said, and ask for its state from time to time.

        Args:
            now: plant time, s.
        """
        while self._receive(0.0, now):
            pass
        clock = time.monotonic()
        if not self.is_busy and clock - self._asked_at > _INTERVAL:
            self._asked_at = clock
            self._send(event("read"))

    def readings(self) -> Mapping[str, Reading]:
        """Return what the hand measured last.

        Returns:
            Readings by vocabulary name; empty if nothing was measured, or the hand is gone.
        """
        return self._readings

    def close(self) -> None:
        """End the process; the fingers keep their grip. Safe to call twice."""
        self._process.close()

    def _send(self, message: dict[str, Any]) -> None:
        try:
            self._process.link.send(message)
        except LinkClosedError as failure:
            self._note_loss(str(failure))

    def _receive(self, timeout: float, now: float) -> bool:
        """Take in one message; return False if there is none."""
        try:
            message = self._process.link.receive(timeout)
        except LinkClosedError as failure:
            self._note_loss(str(failure))
            return False
        if not isinstance(message, dict):
            return False
        if message["is"] == "gone":
            self._note_loss(str(message["reason"]))
            return False
        if message["is"] == "gripped":
            self.is_busy, self.failure = False, message["reason"]
        gap = float(message["gap"])
        # Fingers that close on nothing report a grasp as wide as was commanded.
        holding = bool(message["grasped"]) and gap > self._commanded_gap + _GRASP_ROOM
        at = now - (time.monotonic() - float(message["at"]))
        self._readings = {"finger_gap": Reading(gap, at), "holding": Reading(holding, at)}
        return True

    def _note_loss(self, why: str) -> None:
        self._readings, self.is_busy, self.failure = {}, False, f"the hand is gone: {why}"
