"""Processes that drive the robot: `python -m aeros.franka.process`, started by the plant.

They alone import `pylibfranka`: it may block for a millisecond at a time, and the plant must not. Each has a
session of its own and ignores requests to end: a process that dies in mid-motion cannot brake. It ends when
the plant closes the link or is gone.
"""

from __future__ import annotations

import gc
import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Mapping
from contextlib import suppress
from typing import Any, Final

from aeros.franka.arm import ArmError
from aeros.franka.hand_loop import run_hand
from aeros.franka.libfranka import LibfrankaArm, LibfrankaHand
from aeros.franka.link import LinkClosedError, Message, ProcessLink, event, open_link
from aeros.franka.streamer import Streamer

_START_TIMEOUT: Final = 30.0
"""Longest time for a process to reach the robot, s: the network's own timeout is shorter."""

_END_TIMEOUT: Final = 2.0
"""Longest time for a process to end, s: it brakes first."""

_PRIORITY: Final = 80
"""Real-time priority of the process that drives the arm, as libfranka gives its own threads at most 99."""


class ProcessError(Exception):
    """A process did not come up; the message says why."""


class Process:
    """A process that drives a part of the robot, and the plant's end of its link.

    Args:
        part: `arm` or `hand`.
        settings: of the part, JSON values.
        module: the program.

    Raises:
        ProcessError: it cannot reach the robot.

    Attributes:
        link: to the process.
        pid: its number.
        opened: details of the message that the part is open.
    """

    def __init__(self, part: str, settings: Mapping[str, Any], module: str = "aeros.franka.process") -> None:
        self.opened: Mapping[str, Any] = {}
        self.link, there = open_link()
        order = json.dumps({"part": part, "link": there.fileno(), **settings})
        self._process = subprocess.Popen(  # noqa: S603 - the interpreter itself
            [sys.executable, "-m", module, order],
            pass_fds=[there.fileno()],
            stdin=subprocess.DEVNULL,
            # Ctrl-C and Ctrl-Z go to the terminal's whole process group: this process must live to brake.
            start_new_session=True,
        )
        there.close()
        self.pid = self._process.pid
        try:
            self._wait_until_open(part)
        except ProcessError:
            self.close()
            raise

    def _wait_until_open(self, part: str) -> None:
        try:
            message: Message | None = self.link.receive(_START_TIMEOUT)
        except LinkClosedError as failure:
            raise ProcessError(f"the process of the {part} has ended: {failure}") from failure
        if not isinstance(message, dict):
            raise ProcessError(f"the process of the {part} did not reach the robot in {_START_TIMEOUT:g} s")
        if message["is"] != "open":
            raise ProcessError(str(message["reason"]))
        self.opened = message

    def close(self) -> None:
        """End the process; one that moves the arm brakes first. Safe to call twice."""
        with suppress(LinkClosedError):
            self.link.send(event("close"))
        try:
            self._process.wait(_END_TIMEOUT)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self.link.close()


def run(order: Mapping[str, Any], link: ProcessLink) -> None:
    """Open a part of the robot, and drive it until the plant closes the link.

    Args:
        order: the part and its settings.
        link: to the plant.
    """
    try:
        part = _open_part(order)
    except ArmError as failure:
        with suppress(LinkClosedError):
            link.send(event("failed", reason=str(failure)))
        return
    try:
        link.send(event("open"))
    except LinkClosedError:
        return
    if order["part"] == "hand":
        run_hand(part, link)
        return
    # A collection takes milliseconds, and this loop has one.
    gc.collect()
    gc.disable()
    Streamer(
        part, link, order["acceleration"], order["jerk"], order["patience"], order["start_tolerance"]
    ).run()


def _open_part(order: Mapping[str, Any]) -> Any:
    """Open the arm or the hand.

    Raises:
        ArmError: the robot cannot be reached.
    """
    if order["part"] == "hand":
        return LibfrankaHand(order["address"])
    if order["real_time"]:
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
        except OSError as failure:
            raise ArmError(
                f"this process may not have real-time priority {_PRIORITY}: {failure.strerror}; give the "
                "user `rtprio` in /etc/security/limits.conf (docs/how-to/real-franka.md)"
            ) from failure
    arm = LibfrankaArm(order["address"], real_time=order["real_time"])
    arm.set_thresholds(tuple(order["torques"]), tuple(order["forces"]))
    return arm


def ignore_requests_to_end() -> None:
    """Ignore the signals that end a whole run: this process brakes, and ends after the plant."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)


if __name__ == "__main__":
    ignore_requests_to_end()
    given = json.loads(sys.argv[1])
    run(given, ProcessLink(socket.socket(fileno=given["link"])))
