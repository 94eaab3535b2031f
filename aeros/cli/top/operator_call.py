"""Commands of the operator that `aeros top` gives, while its view goes on."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path

from aeros.descriptions import describe_exception
from aeros.runtime.execution.governor import OperatorCommand
from aeros.runtime.registry.control_page import MotionTimeoutError, request_command
from aeros.runtime.registry.registry import Registry

_DONE = {
    OperatorCommand.PAUSE: "paused: no action starts until `aeros resume`",
    OperatorCommand.STOP: "stopped",
}
_CLOSE_TIMEOUT = 12.0  # s; a command takes effect within 10 s, or says that something still moves


class OperatorCall:
    """Giver of commands to the robot of a state folder, one at a time.

    Args:
        state: the robot's own folder.
        report: called with what has come of a command, in another thread.
    """

    def __init__(self, state: Path, report: Callable[[str], None]) -> None:
        self._state, self._report = state, report
        self._threads: list[threading.Thread] = []
        self._stop: threading.Thread | None = None
        """The newest stop."""

    def give(self, command: OperatorCommand) -> None:
        """Give a command without waiting for its effect; a pause does not replace a stop that has none yet.

        Args:
            command: PAUSE or STOP.
        """
        if command is OperatorCommand.PAUSE and self._stop is not None and self._stop.is_alive():
            return
        self._report(f"{command.name.lower()}: asked")
        thread = threading.Thread(target=self._request, args=(command,), name="aeros-top", daemon=True)
        self._threads.append(thread)
        if command is OperatorCommand.STOP:
            self._stop = thread
        thread.start()

    def close(self) -> None:
        """Wait for commands that were given."""
        for thread in self._threads:
            thread.join(_CLOSE_TIMEOUT)

    def _request(self, command: OperatorCommand) -> None:
        try:
            folder = Registry(self._state).folder
            if not folder.is_dir():
                self._report(f"not given: no robot runs from `{self._state}`")
                return
            request_command(folder, command)
        except MotionTimeoutError as late:
            self._report(f"still moving {late}; use the robot's emergency stop")
        except Exception as failure:
            self._report(f"not given: {describe_exception(failure, one_line=True)}")
        else:
            self._report(_DONE[command])
