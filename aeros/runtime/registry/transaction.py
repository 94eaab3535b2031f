"""Transactions of the registry: one change at a time, stored as a whole, known to every executor.

A change is recorded and signed; then executors are notified; then it is stored. Executors begin no action
between the second and the third. So there is no instant at which a change is stored and an executor does not
know of it, whichever process is killed. A recorded change is stored by whoever reads the registry next.
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
from aeros.runtime.registry.change_log import (
    RecordedState,
    anchor_of,
    read_recorded_state,
    record_change,
    recorded_configurations,
)
from aeros.runtime.registry.control_page import ControlPage, MotionTimeoutError
from aeros.runtime.registry.store import RegistrySnapshot, RegistryStore
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.text.digests import file_digest
from aeros.spec.text.discovery import reference_site_path

_LOCK: Final = "change.lock"
_REPAIR: Final = "run `aeros repair`, which puts the last recorded change in force again"
_SIGN: Final = (
    "an early release may have left it so: look at it with `aeros audit show`; `aeros repair` signs it"
)
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

    @property
    def database(self) -> Path:
        """Path of the database."""
        return self._records.path

    @contextmanager
    def change_lock(self) -> Iterator[RegistrySnapshot]:
        """Serialize changes; if a first change is refused, remove the folder that it created.

        Yields:
            The registry before the change.

        Raises:
            UserError: it cannot be read, or database and record of changes disagree.
        """
        was_there = self.folder.exists()
        with _locked(self.folder / _LOCK):
            try:
                yield self._agreed_snapshot()
            except BaseException:
                if not was_there:
                    (self.folder / _LOCK).unlink(missing_ok=True)
                    _remove_if_empty(self.folder)
                raise

    def snapshot(self) -> RegistrySnapshot:
        """Read the registry.

        Returns:
            Its content now.

        Raises:
            UserError: it cannot be read, or database and record of changes disagree.
        """
        found = self._records.read()
        if self._recorded_state().disagreement(found) is None:
            return found
        # They disagree, or a change is being made.
        with _locked(self.folder / _LOCK):
            return self._agreed_snapshot()

    def _recorded_state(self) -> RecordedState:
        return read_recorded_state(self.folder, self._key)

    def _agreed_snapshot(self) -> RegistrySnapshot:
        """Read the registry while no change is being made; store a change whose process was killed."""
        found, recorded = self._records.read(), self._recorded_state()
        if recorded.is_unfinished(found):
            with ControlPage(self.folder) as live:
                self._store(live, recorded.latest)
            return recorded.latest
        problem = recorded.disagreement(found)
        if problem is not None:
            if not recorded.is_complete_for(found):
                raise _unusable(self.folder, problem, self._restore)
            raise _unusable(self.folder, problem, _REPAIR if recorded.is_signed else _SIGN)
        return found

    def _store(self, live: ControlPage, new: RegistrySnapshot) -> None:
        """Notify executors of a recorded change, and store it.

        Raises:
            UserError: it cannot be stored; until it is, executors begin no action.
        """
        live.publish(new.generation)
        try:
            self._records.replace(new)
        except UserError as failed:
            cure = "no action starts on this robot until it is stored: any command on it tries again"
            raise UserError([replace(one, help=(*one.help, cure)) for one in failed.diagnostics]) from failed

    @property
    def _restore(self) -> str:
        folder, anchor = self.folder, anchor_of(self.folder)
        return (
            f"restore the newest copy of `{folder}` and `{anchor}`; or remove both, install the modules "
            "again, and repeat every block"
        )

    @contextmanager
    def repair_lock(self) -> Iterator[RegistrySnapshot | None]:
        """Serialize a change that puts the last recorded change in force again.

        Yields:
            The state to put in force, with the highest generation that executors may know; None if database
            and record agree.

        Raises:
            UserError: the record is damaged, or ends before the database.
        """
        if not self.folder.is_dir():
            raise _unusable(self.folder, "there is none", "install a module first")
        with _locked(self.folder / _LOCK), ControlPage(self.folder) as live:
            recorded = self._recorded_state()
            try:
                found = self._records.read()
            except UserError:
                found = None
            if found is not None and recorded.is_unfinished(found):
                self._store(live, recorded.latest)
                found = recorded.latest
            problem = recorded.damage if found is None else recorded.disagreement(found)
            if found is not None and problem is None:
                yield None
                return
            if not recorded.is_complete_for(found or RegistrySnapshot()) or not recorded.latest.generation:
                raise _unusable(self.folder, problem or "it has no record of changes", self._restore)
            newest = max(recorded.latest.generation, live.generation)
            yield replace(recorded.latest, generation=newest)

    def set_aside_database(self) -> None:
        """Rename a database that cannot be read, so that the next change creates another.

        Only in `repair_lock`.
        """
        try:
            self._records.read()
        except UserError:
            for suffix in ("", "-journal", "-wal", "-shm"):
                path = self._records.path.with_name(self._records.path.name + suffix)
                with suppress(FileNotFoundError):
                    path.replace(path.with_name(f"{path.name}.damaged"))

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
            UserError: the change cannot be recorded; or it is recorded and cannot be stored, and no action
                starts until it is; or it is stored, and an action of the old configuration still moves.
        """
        if not new.site:
            content = reference_site_path().read_bytes()
            new = replace(new, site=f"policies/{file_digest(content)}.yaml")
            with self.stored_policy(new, content):
                pass
        new = replace(new, generation=old.generation + 1)
        make_folder(self.folder, 0o700)
        unfinished = self._record(old, new, description, configuration)
        with ControlPage(self.folder) as live:
            # If the last change was killed, or gave up waiting, an action older than `old` may still be
            # active.  Its lock is also that of the new generation.
            is_older_still = live.is_idle(new.generation)
            self._store(live, new)
            try:
                live.wait_until_idle(old.generation, _WAIT_TIMEOUT_S)
                if not is_older_still:
                    live.wait_until_idle(new.generation, _WAIT_TIMEOUT_S)
            except MotionTimeoutError as late:
                headline = f"the change is made, but an action of the old configuration still moves {late}"
                raise UserError([Diagnostic("AE966", headline, help=("stop the robot",))]) from late
        if unfinished is not None:
            raise unfinished
        # Modules of past configurations stay, so that decisions under them can be replayed.
        kept = {
            one.digest
            for snapshot in recorded_configurations(self.folder).values()
            for one in snapshot.modules.values()
        }
        remove_unreferenced(self.folder / "modules", kept)

    def _record(
        self, old: RegistrySnapshot, new: RegistrySnapshot, description: str, configuration: Configuration
    ) -> UserError | None:
        """Record a change.

        Returns:
            The error if its record counts, and something failed after that.

        Raises:
            UserError: it cannot be recorded, so it must not be made.
        """
        try:
            record_change(self.folder, self._key, old, new, description, configuration.digest)
        except UserError as failed:
            if self._recorded_state().latest != new:
                raise
            headlines = "; ".join(one.headline for one in failed.diagnostics)
            return UserError([Diagnostic("AE965", f"the change is in force, though {headlines}")])
        return None

    @contextmanager
    def stored_policy(self, new: RegistrySnapshot, content: bytes) -> Iterator[Path]:
        """Store the policy file of a registry that is about to be committed; if the block fails, remove it.

        Args:
            new: the registry; it names the file.
            content: of the file.

        Yields:
            The file.
        """
        path = self.folder / new.site
        is_new = not path.exists()
        make_folder(path.parent, 0o700)
        replace_durably(path, content)
        try:
            yield path
        except BaseException:
            if is_new:
                path.unlink(missing_ok=True)
                _remove_if_empty(path.parent)
            raise

    def committed_snapshot(self, live: ControlPage) -> RegistrySnapshot | None:
        """Read the registry unless a change is in progress.

        If the process that made a change died before storing it, it is stored now if it is recorded.

        Args:
            live: control page of this registry.

        Returns:
            The content, not yet compared with the record; None while executors know of a change that is not
            stored.

        Raises:
            UserError: it cannot be read, or database and record of changes disagree.
        """
        snapshot = self._records.read()
        if snapshot.generation == live.generation:
            return snapshot
        with suppress(BlockingIOError), _locked(self.folder / _LOCK, fcntl.LOCK_NB):
            live.publish(self._agreed_snapshot().generation)
        return None


def _unusable(folder: Path, problem: str, cure: str) -> UserError:
    return UserError(
        [Diagnostic("AE965", f"the registry `{folder}` cannot be used: {problem}", help=(cure,))]
    )


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
        lock = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
    except FileNotFoundError:
        return None
    except OSError as failure:
        cure = "remove it; it holds nothing"
        raise _unusable(path.parent, f"`{path}` cannot be locked: {failure.strerror}", cure) from failure
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
