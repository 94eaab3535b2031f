"""Processes that drive the parts of a robot, and the plant's end of each.

The plant must not block, and what drives a robot may. Each process has a session of its own and ignores
requests to end: a process that dies in mid-motion cannot brake. It ends when the plant closes the link or is
gone.
"""

from __future__ import annotations

import json
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any, Final, TypeVar

from aeros.wired_arm.link import LinkClosedError, Message, ProcessLink, event, open_link

Part = TypeVar("Part")

_START_TIMEOUT: Final = 30.0
"""Longest time for a process to reach the robot, s: the network's own timeout is shorter."""

_END_TIMEOUT: Final = 2.0
"""Longest time for a process to end, s: it brakes first."""


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

    def __init__(self, part: str, settings: Mapping[str, Any], module: str) -> None:
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


def open_part(link: ProcessLink, opened: Callable[[], Part], failure: type[Exception]) -> Part | None:
    """Open a part of the robot, and report to the plant if that fails.

    Args:
        link: to the plant.
        opened: opens the part.
        failure: what it raises if the robot cannot be reached; the message says why.

    Returns:
        The part; None if it cannot be opened.
    """
    try:
        return opened()
    except failure as reason:
        with suppress(LinkClosedError):
            link.send(event("failed", reason=str(reason)))
        return None


def ignore_requests_to_end() -> None:
    """Ignore the signals that end a whole run: this process brakes, and ends after the plant."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)


def drive(run: Callable[[Mapping[str, Any], ProcessLink], None]) -> None:
    """Run the program of a process, as `Process` starts it.

    Args:
        run: drives a part of the robot until the plant closes the link, by an order of JSON values.
    """
    ignore_requests_to_end()
    order = json.loads(sys.argv[1])
    run(order, ProcessLink(socket.socket(fileno=order["link"])))
