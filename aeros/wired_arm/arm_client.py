"""The plant's end of the process that drives the arm."""

from __future__ import annotations

import time
from collections.abc import Mapping
from math import inf
from typing import Any, Final, NamedTuple

from aeros.runtime.ports import PlantLostError, Trajectory
from aeros.wired_arm.arm import ArmState
from aeros.wired_arm.link import JudgedMessage, LinkClosedError, Message, StartMessage, StateMessage, event
from aeros.wired_arm.process import Process

SILENCE: Final = 2.0
"""Longest time without a state of the robot, s: it sends one each millisecond."""

_FRESH: Final = 0.02
"""Age up to which the newest state is returned again while nothing moves, s."""


class RobotLostError(PlantLostError):
    """The robot, or the process that drives it, can no longer be reached; the message says why."""


class StreamEnd(NamedTuple):
    """End of a streamed motion.

    Attributes:
        reason: why the arm was stopped by its process, or by the robot; None if neither was the case.
        is_braked: the motion was braked before its end.
    """

    reason: str | None
    is_braked: bool


class ArmClient:
    """The arm, as the plant drives it.

    Args:
        settings: JSON values for the process.
        module: program of the process.

    Raises:
        ProcessError: the robot cannot be reached.

    Attributes:
        state: the newest state that was read.
        is_streaming: a motion is streamed.
        own_stop: why the process brakes by itself; None if it does not.
        end: of the motion that was streamed last; None while it is streamed.
        ended_at: time of the newest state when it ended, s.
        cycle_times: of the motion that was streamed last: `streamer.CycleTimes.summary`.
        pid: number of the process.
        opened: what the process said as it had reached the robot.
    """

    state: ArmState

    def __init__(self, settings: Mapping[str, Any], module: str) -> None:
        self._process = Process("arm", settings, module)
        self.pid = self._process.pid
        self.opened = self._process.opened
        self.is_streaming = False
        self.own_stop: str | None = None
        self.end: StreamEnd | None = None
        self.ended_at = -inf
        self.cycle_times: Mapping[str, float] = {}
        self._is_watched = False
        self._wants_brake = self._has_ordered_brake = False
        self._received = 0.0
        self._loss: str | None = None

    def refresh(self) -> bool:
        """Ask for a state, unless the newest one has just come; nothing is streamed.

        Returns:
            True if there is a new state.

        Raises:
            RobotLostError: there is none within `SILENCE`.
        """
        if time.monotonic() - self._received < _FRESH:
            return False
        while self._receive(0.0) is not None:
            pass  # of a time when all states were asked for
        self._send(event("read"))
        while not isinstance(self._receive(SILENCE), StateMessage):
            pass
        return True

    def watch(self, *, on: bool) -> None:
        """Ask for every state, or for no more.

        Args:
            on: True for every state.
        """
        if on is not self._is_watched and self._send(event("watch", on=on)):
            self._is_watched = on

    def start(self, plan: Trajectory) -> None:
        """Begin to stream a motion.

        Args:
            plan: the decided motion.
        """
        self._wants_brake = self._has_ordered_brake = False
        self.own_stop = self.end = None
        self.is_streaming = self._send(StartMessage(plan.joint_paths[0], plan.duration))
        if not self.is_streaming:
            self.end = StreamEnd("busy: the streaming process reads no orders; nothing has begun", False)
            self.ended_at = self.state.time

    def brake(self) -> None:
        """Brake the motion that is streamed, if any; `wait` repeats an order for which there is no room."""
        if self.is_streaming and not self._has_ordered_brake:
            self._wants_brake = True
            self._has_ordered_brake = self._send(event("brake"))

    def acknowledge(self) -> None:
        """Say that the monitor has judged the newest state."""
        if self.is_streaming:
            self._send(JudgedMessage(self.state.time))

    def wait(self) -> bool:
        """Wait for the next message of the process.

        Returns:
            True if it is a state.

        Raises:
            RobotLostError: there is none within `SILENCE`.
        """
        if self._wants_brake:
            self.brake()
        return isinstance(self._receive(SILENCE), StateMessage)

    def close(self) -> None:
        """End the process, which brakes first; safe to call twice."""
        self.is_streaming = False
        self._process.close()

    def _send(self, message: Message) -> bool:
        """Send a message; False if there is no room for it now."""
        try:
            return self._process.link.send(message)
        except LinkClosedError:
            return True  # The process has ended: the next message to be received says why.

    def _receive(self, timeout: float) -> Message | None:
        """Receive a message and take it in; None if `timeout` is 0 and there is none."""
        try:
            message = self._process.link.receive(timeout)
        except LinkClosedError as failure:
            raise self._note_loss(str(failure)) from failure
        if isinstance(message, StateMessage):
            self.state, self._received = message.state, time.monotonic()
        elif isinstance(message, dict):
            self._take_event(message)
        elif message is None and timeout > 0.0:
            raise self._note_loss(f"the robot has sent nothing for {timeout:g} s")
        return message

    def _take_event(self, message: dict[str, Any]) -> None:
        kind = message.pop("is")
        if kind == "gone":
            raise self._note_loss(str(message["reason"]))
        if kind == "braking":
            self.own_stop = str(message["reason"])
        elif kind == "ended":
            self.end = StreamEnd(message.pop("reason"), message.pop("braked"))
            self.cycle_times, self.is_streaming, self.ended_at = message, False, self.state.time

    def _note_loss(self, why: str) -> RobotLostError:
        """Note that no message will come any more; the first reason counts."""
        self._loss = self._loss or why
        if self.is_streaming:
            self.is_streaming, self.end = False, StreamEnd(f"gone: {self._loss}", False)
        return RobotLostError(self._loss)
