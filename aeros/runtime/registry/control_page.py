"""Control page: how one process tells a running executor that the configuration changed, to pause or to stop.

It consists of a page of shared memory, which the executor reads before every action and at every control
tick, and of two lock files. An action is executed under a shared lock that belongs to the generation it was
decided under. A change of the configuration takes that lock exclusively. So it returns only when no action
of the old generation is active: each has ended, was stopped, or its process died. Generations alternate
between the two files, so that actions of the new generation delay nobody.
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

from aeros.files import make_folder, try_lock
from aeros.runtime.execution.governor import OperatorCommand

_PAGE: Final = struct.Struct("<QQQ")  # generation, command, command of peers
_POLL_INTERVAL_S: Final = 0.002  # s, while waiting for actions to end
_WAIT_TIMEOUT_S: Final = 10.0  # s, for a protective stop or the end of an action


class MotionTimeoutError(Exception):
    """Actions of the old configuration did not end in time."""


class CommandStandsError(Exception):
    """A command of the robot's own terminals stands, above that of a peer."""


class ControlPage:
    """Shared page and locks in a folder; created if they do not exist.

    Args:
        folder: the registry's folder.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        make_folder(folder, 0o700)
        self._file = _open_file(folder / "live")
        if os.fstat(self._file).st_size < _PAGE.size:
            os.ftruncate(self._file, _PAGE.size)
        self._page = mmap.mmap(self._file, _PAGE.size)
        self._locks = [_open_file(folder / f"motion-{parity}.lock") for parity in (0, 1)]

    @property
    def generation(self) -> int:
        """Latest published generation."""
        return int.from_bytes(self._page[0:8], "little")

    def publish(self, generation: int) -> None:
        """Publish a generation to executors: a single aligned store, so that nobody reads half of it.

        Args:
            generation: number of the new configuration.
        """
        self._page[0:8] = generation.to_bytes(8, "little")

    @property
    def command(self) -> OperatorCommand:
        """Stricter one of the latest commands of the operator and of peers.

        A stop if it cannot be read, or the page was deleted.
        """
        # Nobody can reach a run through a page that was deleted with the state folder.
        if os.fstat(self._file).st_nlink == 0:
            return OperatorCommand.STOP
        try:
            own, peers = self._page[8:16], self._page[16:24]
            return OperatorCommand(max(int.from_bytes(own, "little"), int.from_bytes(peers, "little")))
        except ValueError:
            return OperatorCommand.STOP

    def request_command(self, command: OperatorCommand, *, is_of_peer: bool = False) -> None:
        """Publish a command to executors.

        A peer's pause and its end have a word of their own, so that no peer lifts a pause or a stop that was
        given elsewhere. A peer's stop is the operator's.

        Args:
            command: the operator's command.
            is_of_peer: the command comes from another program, such as a ROS 2 node.
        """
        word = command.value.to_bytes(8, "little")
        if command is OperatorCommand.STOP or not is_of_peer:
            self._page[8:16] = word
        if command is OperatorCommand.RUN or is_of_peer:
            self._page[16:24] = word

    @contextmanager
    def hold_generation(self, generation: int) -> Iterator[bool]:
        """Keep a change of the configuration from returning while the block runs.

        Args:
            generation: the generation that the caller is about to act under.

        Yields:
            True if `generation` is still the latest.
        """
        lock = self._locks[generation % 2]
        fcntl.flock(lock, fcntl.LOCK_SH)
        try:
            yield self.generation == generation
        finally:
            fcntl.flock(lock, fcntl.LOCK_UN)

    def is_idle(self, generation: int) -> bool:
        """Check if all actions of a generation have ended.

        Also False for an action of another generation with the same lock.

        Args:
            generation: any generation.

        Returns:
            True if no action is active that was decided under `generation`.
        """
        # A second open file, because locks of the same open file do not exclude each other.
        lock = _open_file(self._folder / f"motion-{generation % 2}.lock")
        try:
            return try_lock(lock)
        finally:
            os.close(lock)

    def wait_until_idle(self, generation: int, patience: float) -> None:
        """Wait until no action is active that was decided under `generation`.

        Args:
            generation: any generation.
            patience: s of real time.

        Raises:
            MotionTimeoutError: an action is still active after that time.
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


def request_command(folder: Path, command: OperatorCommand, *, is_of_peer: bool = False) -> None:
    """Send a command to the executors of a registry and wait until it takes effect.

    A pause or a stop has taken effect once no action is active.

    Args:
        folder: the registry's folder.
        command: the operator's command.
        is_of_peer: the command comes from another program, such as a ROS 2 node.

    Raises:
        MotionTimeoutError: an action is still active after 10 s.
        CommandStandsError: a peer lets actions start again, and a command from elsewhere stands.
    """
    with ControlPage(folder) as live:
        live.request_command(command, is_of_peer=is_of_peer)
        if command is OperatorCommand.RUN and (standing := live.command) is not OperatorCommand.RUN:
            raise CommandStandsError(f"a {standing.name.lower()} stands")
        if command is not OperatorCommand.RUN:
            # An action of an earlier generation may hold the lock of the next one.
            for generation in (live.generation, live.generation + 1):
                live.wait_until_idle(generation, _WAIT_TIMEOUT_S)


def _open_file(path: Path) -> int:
    return os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
