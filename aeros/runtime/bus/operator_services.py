"""Services for the operator's commands to a run: `/aeros/pause`, `/aeros/resume`, `/aeros/stop`."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any, Final

from aeros.runtime.bus.messages import TriggerRequest, TriggerResponse
from aeros.runtime.bus.port import Requester, ServingBus
from aeros.runtime.execution.governor import OperatorCommand
from aeros.runtime.registry.control_page import (
    CommandStandsError,
    MotionTimeoutError,
    request_command,
)

TRIGGER: Final = (TriggerRequest, TriggerResponse)

_SERVICES: Final = {
    "/aeros/pause": (OperatorCommand.PAUSE, "paused: no action starts until `/aeros/resume`"),
    "/aeros/resume": (OperatorCommand.RUN, "resumed"),
    "/aeros/stop": (OperatorCommand.STOP, "stopped"),
}

RecordRequest = Callable[[str, Mapping[str, Any]], object]
"""Puts an event and its details into the audit record; any thread may call it."""


class OperatorRequests:
    """Operator's commands that arrive on a bus; each is recorded with its requesters.

    Requests that arrive before the audit log is open are recorded once it is. Thread-safe.

    Args:
        folder: registry's folder of the executor.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._record: RecordRequest | None = None
        self._waiting: list[Mapping[str, Any]] = []
        self._lock = threading.Lock()

    def open_record(self, record: RecordRequest) -> None:
        """Record the requests so far, and all later ones.

        Args:
            record: puts an event into the audit record.
        """
        with self._lock:
            self._record = record
            for details in self._waiting:
                record(OPERATOR_REQUEST, details)
            self._waiting.clear()

    def close_record(self) -> None:
        """Record no more: the audit log is about to be closed."""
        with self._lock:
            self._record = None

    def request(
        self, command: OperatorCommand, service: str, requesters: Callable[[], Sequence[Requester]]
    ) -> str | None:
        """Give a command and wait until it has taken effect.

        A resume is recorded before it is given, and refused if it cannot be. A pause and a stop are given
        first: nothing that goes wrong in a record keeps motion from stopping.

        Args:
            command: the command.
            service: name of the service that was called.
            requesters: returns the nodes that may have called it.

        Returns:
            None; or the reason if it has not taken effect.
        """
        if command is not OperatorCommand.RUN:
            failure = self._give(command)
            with suppress(Exception):  # a log that cannot be written ends the run by itself
                self._note(command, service, requesters())
            return failure
        try:
            self._note(command, service, requesters())
        except Exception as error:
            return f"it cannot be recorded: {error}"
        return self._give(command)

    def _give(self, command: OperatorCommand) -> str | None:
        try:
            request_command(self._folder, command, is_of_peer=True)
        except CommandStandsError as standing:
            return f"{standing}: `aeros resume` at the robot lifts it"
        except MotionTimeoutError as late:
            return f"still moving {late}; use the robot's emergency stop"
        except OSError as failure:
            return f"the run cannot be reached: {failure}"
        return None

    def _note(self, command: OperatorCommand, service: str, requesters: Sequence[Requester]) -> None:
        details = {
            "command": command.name.lower(),
            "service": service,
            "clients": [one._asdict() for one in requesters],
        }
        with self._lock:
            if self._record is None:
                self._waiting.append(details)
            else:
                self._record(OPERATOR_REQUEST, details)


OPERATOR_REQUEST: Final = "operator-request"
"""Event of a command that arrived on a bus."""


@contextmanager
def serve_operator_commands(bus: ServingBus, requests: OperatorRequests) -> Iterator[None]:
    """Offer the services while the block runs.

    Each does what the command of its name does, and answers once it has taken effect: pause and stop when no
    action is active, or with failure if one still is after some seconds. The calling thread waits, so it must
    not be the executor's.

    Args:
        bus: bus to offer them on.
        requests: carries them out.
    """
    with ExitStack() as offered:
        for name, (command, done) in _SERVICES.items():
            offered.callback(bus.serve(name, TRIGGER, _command_handler(bus, name, requests, command, done)))
        yield


def _command_handler(
    bus: ServingBus, name: str, requests: OperatorRequests, command: OperatorCommand, done: str
) -> Callable[[TriggerRequest], TriggerResponse]:
    def answer(request: TriggerRequest) -> TriggerResponse:
        failure = requests.request(command, name, lambda: bus.requesters(name))
        return TriggerResponse(failure is None, failure or done)

    return answer
