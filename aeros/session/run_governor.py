"""The governor of one run: the operator's commands, and a stop on Ctrl-C or when the supervisor is gone."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from contextlib import AbstractContextManager
from types import FrameType
from typing import Final, Self

from aeros.runtime.execution.governor import Governor, OperatorCommand
from aeros.runtime.gate.configuration import Configuration
from aeros.session.sd_notify import Notifier

_STDERR: Final = 2
_STOP_MESSAGE: Final = b"stopping the robot; press Ctrl-C again to exit at once\n"


class RunGovernor:
    """A `Governor` that wraps another and adds Ctrl-C, loss of the supervisor, and the heartbeat.

    The command is STOP after `interrupt` was called or the supervisor is gone, otherwise that of the wrapped
    governor.
    The executor reads it before every action, at every control tick and while the operator pauses, so each
    read also sends the heartbeat to the supervisor.

    As a context manager it turns SIGINT into `interrupt`.  An exception could strike between any two
    instructions and leave a record of the audit log half written.  The second SIGINT does raise
    KeyboardInterrupt, for code that never reads the command.  Enter it in the main thread only.

    Args:
        governor: Returns the configuration in force and the operator's command.
        notifier: Connection to the supervisor; None for none.

    Attributes:
        on_command: Called with each change of the command.
        is_interrupted: True if `interrupt` was called.
    """

    def __init__(self, governor: Governor, notifier: Notifier | None = None) -> None:
        self._governor = governor
        self._notifier = notifier
        self._last = OperatorCommand.RUN
        self.on_command: Callable[[OperatorCommand], None] = lambda _: None
        self.is_interrupted = False

    def __enter__(self) -> Self:
        self._former = signal.signal(signal.SIGINT, self._on_sigint)
        return self

    def __exit__(self, *_: object) -> None:
        signal.signal(signal.SIGINT, self._former)

    def _on_sigint(self, _number: int, _frame: FrameType | None) -> None:
        if self.is_interrupted:
            raise KeyboardInterrupt
        self.interrupt()
        # Not `print`: the signal may have interrupted a `print`.
        os.write(_STDERR, _STOP_MESSAGE)

    def interrupt(self) -> None:
        """Stop the run permanently; any thread may call it."""
        self.is_interrupted = True

    @property
    def command(self) -> OperatorCommand:
        """Implement `Governor.command`."""
        is_alone = False
        if self._notifier is not None:
            self._notifier.send_heartbeat()
            is_alone = self._notifier.is_alone
        command = OperatorCommand.STOP if is_alone or self.is_interrupted else self._governor.command
        if command is not self._last:
            self._last = command
            self.on_command(command)
        return command

    @property
    def generation(self) -> int:
        """Implement `Governor.generation`."""
        return self._governor.generation

    def configuration(self) -> tuple[int, Configuration]:
        """Implement `Governor.configuration`."""
        return self._governor.configuration()

    def hold_generation(self, generation: int) -> AbstractContextManager[bool]:
        """Implement `Governor.hold_generation`."""
        return self._governor.hold_generation(generation)

    def revocation_reason(self, module: str, skill: str, kind: str) -> str | None:
        """Implement `Governor.revocation_reason`."""
        return self._governor.revocation_reason(module, skill, kind)
