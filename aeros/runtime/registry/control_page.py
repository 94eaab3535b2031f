"""What one terminal tells an executor in another: that the configuration changed, to pause, to stop.

A page of shared memory that the executor looks at before every action and at every control tick,
and two lock files.  An action is executed under a shared lock that belongs to the generation it was
decided under; who has changed the configuration takes that lock alone, and so returns only when no
action of the old generation moves any more, be it that it ended, was stopped, or its process died.
Generations alternate between the two files: actions of the new one make nobody wait.
"""

from __future__ import annotations

import fcntl
import mmap
import os
import struct
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final, Self

from aeros.files import try_lock
from aeros.runtime.execution.governor import OperatorCommand

_PAGE: Final = struct.Struct("<QQ")  # generation, command
_POLL_INTERVAL_S: Final = 0.002  # s, while waiting for actions to end
_WAIT_TIMEOUT_S: Final = 10.0  # s, for a protective stop or the end of an action


class MotionTimeoutError(Exception):
    """Actions of the old configuration did not end in time."""


class ControlPage:
    """The shared page and the locks in `folder`, which are made if they are not there."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        self._file = _open_file(folder / "live")
        if os.fstat(self._file).st_size < _PAGE.size:
            os.ftruncate(self._file, _PAGE.size)
        self._page = mmap.mmap(self._file, _PAGE.size)
        self._locks = [_open_file(folder / f"motion-{parity}.lock") for parity in (0, 1)]

    @property
    def generation(self) -> int:
        """The latest generation that was published."""
        return int.from_bytes(self._page[0:8], "little")

    def publish(self, generation: int) -> None:
        """Let executors know of a change; a single aligned store, so nobody reads half of it."""
        self._page[0:8] = generation.to_bytes(8, "little")

    @property
    def command(self) -> OperatorCommand:
        """What was asked for last; what cannot be read is a stop."""
        try:
            return OperatorCommand(int.from_bytes(self._page[8:16], "little"))
        except ValueError:
            return OperatorCommand.STOP

    def request_command(self, command: OperatorCommand) -> None:
        """Ask whoever executes to do so."""
        self._page[8:16] = command.value.to_bytes(8, "little")

    @contextmanager
    def hold_generation(self, generation: int) -> Iterator[bool]:
        """Whether `generation` is still the latest; if so nobody's change returns while the block runs."""
        lock = self._locks[generation % 2]
        fcntl.flock(lock, fcntl.LOCK_SH)
        try:
            yield self.generation == generation
        finally:
            fcntl.flock(lock, fcntl.LOCK_UN)

    def is_idle(self, generation: int) -> bool:
        """Whether no action moves that was decided under `generation`, or any other one of its lock."""
        # A file of its own: the locks of one open file do not exclude each other.
        lock = _open_file(self._folder / f"motion-{generation % 2}.lock")
        try:
            return try_lock(lock)
        finally:
            os.close(lock)

    def wait_until_idle(self, generation: int, patience: float) -> None:
        """Return when no action that was decided under `generation` moves.

        patience: seconds; raises `MotionTimeoutError` after them.
        """
        latest = time.monotonic() + patience
        while not self.is_idle(generation):
            if time.monotonic() > latest:
                raise MotionTimeoutError(f"after {patience:g} s")
            time.sleep(_POLL_INTERVAL_S)

    def close(self) -> None:
        """Release the page and the locks; safe to call twice."""
        if self._file >= 0:
            self._page.close()
            for descriptor in (self._file, *self._locks):
                os.close(descriptor)
            self._file = -1

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def request_command(folder: Path, command: OperatorCommand) -> None:
    """Ask whoever executes from `folder` for `command`, and return when it is so.

    That is, for a pause or a stop, when nothing moves; raises `MotionTimeoutError` where it does after 10 s.
    """
    with ControlPage(folder) as live:
        live.request_command(command)
        if command is not OperatorCommand.RUN:
            # Under the lock of the next one, too, an action of an earlier one may move.
            for generation in (live.generation, live.generation + 1):
                live.wait_until_idle(generation, _WAIT_TIMEOUT_S)


def _open_file(path: Path) -> int:
    return os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
