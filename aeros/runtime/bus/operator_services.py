"""Services for the operator's commands to a run: `/aeros/pause`, `/aeros/resume`, `/aeros/stop`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Final

from aeros.runtime.bus.messages import TriggerRequest, TriggerResponse
from aeros.runtime.bus.port import Bus
from aeros.runtime.execution.governor import OperatorCommand
from aeros.runtime.registry.control_page import MotionTimeoutError, request_command

TRIGGER: Final = (TriggerRequest, TriggerResponse)

_SERVICES: Final = {
    "/aeros/pause": (OperatorCommand.PAUSE, "paused: no action starts until `/aeros/resume`"),
    "/aeros/resume": (OperatorCommand.RUN, "resumed"),
    "/aeros/stop": (OperatorCommand.STOP, "stopped"),
}


@contextmanager
def serve_operator_commands(bus: Bus, folder: Path) -> Iterator[None]:
    """Offer the services while the block runs.

    Each does what the command of its name does, and answers once it has taken effect: pause and stop when no
    action is active, or with failure if one still is after some seconds. The calling thread waits, so it must
    not be the executor's.

    Args:
        bus: bus to offer them on.
        folder: registry's folder of the executor.
    """
    with ExitStack() as offered:
        for name, (command, done) in _SERVICES.items():
            offered.callback(bus.serve(name, TRIGGER, _command_handler(folder, command, done)))
        yield


def _command_handler(
    folder: Path, command: OperatorCommand, done: str
) -> Callable[[TriggerRequest], TriggerResponse]:
    def answer(request: TriggerRequest) -> TriggerResponse:
        try:
            request_command(folder, command)
        except MotionTimeoutError as late:
            return TriggerResponse(False, f"still moving {late}; use the robot's emergency stop")
        except OSError as failure:
            return TriggerResponse(False, f"the run cannot be reached: {failure}")
        return TriggerResponse(True, done)

    return answer
