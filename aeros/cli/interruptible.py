"""Ctrl-C during a run: a stop like the operator's, and the run ends by itself."""

from __future__ import annotations

import os
import signal
from types import FrameType
from typing import Final, Self

from aeros.cli.relay import Relay
from aeros.runtime.governor import Command, Governor

_STDERR: Final = 2
_TOLD: Final = b"stopping; Ctrl-C again ends at once\n"


class Interruptible(Relay):
    """A governor that asks for a stop once SIGINT has come, as long as it is entered.

    An exception in its place may come between any two instructions, and so leave a record of the audit log
    half written.  The second SIGINT does raise KeyboardInterrupt: for code that never looks here.
    """

    def __init__(self, governor: Governor) -> None:
        super().__init__(governor)
        self.is_interrupted = False

    def __enter__(self) -> Self:
        self._former = signal.signal(signal.SIGINT, self._interrupt)
        return self

    def __exit__(self, *_: object) -> None:
        signal.signal(signal.SIGINT, self._former)

    def _interrupt(self, _number: int, _frame: FrameType | None) -> None:
        if self.is_interrupted:
            raise KeyboardInterrupt
        self.interrupt()
        # Not `print`: what was interrupted may be a `print`.
        os.write(_STDERR, _TOLD)

    def interrupt(self) -> None:
        """Ask for a stop, for good."""
        self.is_interrupted = True

    @property
    def command(self) -> Command:
        """See `Governor`."""
        return Command.STOP if self.is_interrupted else self._governor.command
