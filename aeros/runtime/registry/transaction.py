"""Transactions of the registry: one change at a time, stored as a whole, known to every executor.

Executors are notified before the record is replaced, and begin no action until it is. So there is no instant
at which a change is stored and an executor does not know of it, whichever process is killed.
"""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Final

from aeros.files import make_folder, replace_durably
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.registry.bundle_store import remove_unreferenced
from aeros.runtime.registry.change_log import record_change, recorded_configurations
from aeros.runtime.registry.control_page import ControlPage, MotionTimeoutError
from aeros.runtime.registry.store import RegistrySnapshot, RegistryStore
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.text.digests import file_digest
from aeros.spec.text.discovery import reference_site_path

_LOCK: Final = "change.lock"
_WAIT_TIMEOUT_S: Final = 30.0  # s that a change waits for motions of the old configuration to end


class RegistryTransactions:
    """Transactions on the registry in one folder.

    Args:
        folder: the registry's folder.
        key: path of the key that signs the log of changes; need not exist.
    """

    def __init__(self, folder: Path, key: Path) -> None:
        self.folder = folder
        self._key = key
        self._records = RegistryStore(folder)

    @contextmanager
    def change_lock(self) -> Iterator[RegistrySnapshot]:
        """Serialize changes; if a first change is refused, remove the folder that it created.

        Yields:
            The registry before the change.

        Raises:
            UserError: it cannot be read.
        """
        was_there = self.folder.exists()
        with _locked(self.folder / _LOCK):
            try:
                yield self._records.read()
            except BaseException:
                if not was_there:
                    (self.folder / _LOCK).unlink(missing_ok=True)
                    _remove_if_empty(self.folder)
                raise

    def commit(
        self, old: RegistrySnapshot, new: RegistrySnapshot, description: str, configuration: Configuration
    ) -> None:
        """Record a change, store it, and wait until nothing of the old configuration moves.

        Args:
            old: the registry before the change, from `change_lock`, which must still be held.
            new: the registry after it; its generation is set here.
            description: the change in words, for the log.
            configuration: the proved configuration that `new` puts in force.

        Raises:
            UserError: the change cannot be recorded or stored; or it is stored, and an action of the old
                configuration still moves.
        """
        if not new.site:
            content = reference_site_path().read_bytes()
            new = replace(new, site=f"policies/{file_digest(content)}.yaml")
            self.store_policy(new, content)
        new = replace(new, generation=old.generation + 1)
        make_folder(self.folder, 0o700)
        record_change(self.folder, self._key, old, new, description, configuration.digest)
        with ControlPage(self.folder) as live:
            # If the last change was killed, or gave up waiting, an action older than `old` may still be
            # active.  Its lock is also that of the new generation.
            is_older_still = live.is_idle(new.generation)
            live.publish(new.generation)
            try:
                self._records.replace(new)
            except BaseException:
                live.publish(self._records.read().generation)
                raise
            try:
                live.wait_until_idle(old.generation, _WAIT_TIMEOUT_S)
                if not is_older_still:
                    live.wait_until_idle(new.generation, _WAIT_TIMEOUT_S)
            except MotionTimeoutError as late:
                headline = f"the change is made, but an action of the old configuration still moves {late}"
                raise UserError([Diagnostic("AE966", headline, help=("stop the robot",))]) from late
        # Modules of past configurations stay, so that decisions under them can be replayed.
        kept = [
            one
            for snapshot in recorded_configurations(self.folder).values()
            for one in snapshot.modules.values()
        ]
        remove_unreferenced(self.folder / "modules", {self.folder / one.folder for one in kept})

    def store_policy(self, new: RegistrySnapshot, content: bytes) -> None:
        """Store the policy file of a registry that is about to be committed.

        Args:
            new: the registry; it names the file.
            content: of the file.
        """
        path = self.folder / new.site
        make_folder(path.parent, 0o700)
        replace_durably(path, content)

    def committed_snapshot(self, live: ControlPage) -> RegistrySnapshot | None:
        """Read the registry unless a change is in progress.

        If the process that made a change died before storing it, its announcement is withdrawn.

        Args:
            live: control page of this registry.

        Returns:
            The content; None while executors know of a change that is not stored.

        Raises:
            UserError: it cannot be read.
        """
        snapshot = self._records.read()
        if snapshot.generation == live.generation:
            return snapshot
        with suppress(BlockingIOError), _locked(self.folder / _LOCK, fcntl.LOCK_NB):
            live.publish(self._records.read().generation)
        return None


@contextmanager
def _locked(path: Path, how: int = 0) -> Iterator[None]:
    """Hold the lock file at `path`; its folder is created if needed.

    A refused first change deletes the file. A lock on a deleted file protects nothing, so it is taken again.
    """
    while (lock := _locked_file(path, how)) is None:
        pass
    try:
        yield
    finally:
        os.close(lock)


def _locked_file(path: Path, how: int) -> int | None:
    """Open and lock the file at `path`; return None if it was deleted before it was locked."""
    make_folder(path.parent, 0o700)
    try:
        lock = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    except FileNotFoundError:
        return None
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | how)
        if _is_same_file(path, lock):
            return lock
    except BaseException:
        os.close(lock)
        raise
    os.close(lock)
    return None


def _is_same_file(path: Path, descriptor: int) -> bool:
    """Return True if the open file is the file at `path`."""
    try:
        return os.path.samestat(path.stat(), os.fstat(descriptor))
    except FileNotFoundError:
        return False


def _remove_if_empty(folder: Path) -> None:
    with suppress(OSError):
        folder.rmdir()
        folder.parent.rmdir()
